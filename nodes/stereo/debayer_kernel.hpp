// SPDX-License-Identifier: Apache-2.0
// Internal: rows of raw pixels made ready for resampling, as signed bytes (value - 128; remap_kernel.hpp says why).
// Nothing outside the rows is touched.
#pragma once
#include <cstdint>

#include "nodes/stereo/debayer.hpp"

namespace takt::stereo {

struct DebayerKernels {
  /// `count` >= 2 pixels of a mosaic with the rows above and below it, to blue, green, red and a fourth byte that means
  /// nothing.
  void (*debayer)(const uint8_t* above, const uint8_t* row, const uint8_t* below, int count, MosaicRow colours,
                  int8_t* out);
  /// BGR to the same four bytes.
  void (*expand)(const uint8_t* bgr, int count, int8_t* out);
  /// Grey to one byte each.
  void (*grey)(const uint8_t* in, int count, int8_t* out);
};

const DebayerKernels& debayer_kernels();

}  // namespace takt::stereo
