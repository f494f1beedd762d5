// SPDX-License-Identifier: Apache-2.0
// Internal: bilinear resampling of one row from a window of source rows. Source bytes are signed (value - 128): weights
// of 0..128 are then the unsigned operand of a byte multiply-add.
#pragma once
#include <cstddef>
#include <cstdint>

namespace takt::stereo {

/// Pixels that are made at once at most; offsets and fractions are padded to a multiple of it.
constexpr int kRemapGroup = 16;

struct RemapRow {
  const int8_t* window;       ///< pixels of 4 bytes (blue, green, red, anything) or of 1
  ptrdiff_t stride;           ///< bytes from one source row to the next
  const uint32_t* offsets;    ///< pixels from `window` to the upper left of the four
  const uint16_t* fractions;  ///< 1/128 px: along x, and along y in the high byte
  int count;                  ///< pixels to be made
};

struct RemapKernels {
  /// out[i] = the four pixels at offsets[i], weighted, rounded. Nothing beyond `count` pixels of `out` is touched.
  void (*bgr)(const RemapRow& row, uint8_t* out);
  void (*grey)(const RemapRow& row, uint8_t* out);
};

const RemapKernels& remap_kernels();

}  // namespace takt::stereo
