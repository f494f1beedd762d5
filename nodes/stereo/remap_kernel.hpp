// SPDX-License-Identifier: Apache-2.0
// Internal: bilinear resampling of one row.
#pragma once
#include <cstddef>
#include <cstdint>

namespace takt::stereo {

/// Where a rectified pixel comes from: top left of the four source pixels and the fractions in 1/128 px (0..128).
struct RemapSource {
  int16_t x = -1, y = -1;  ///< -1: outside, gives 0
  uint8_t fraction_x = 0, fraction_y = 0;
};

struct RemapImage {
  const uint8_t* data;
  ptrdiff_t stride;
  int width, height, channels;
};

/// out[i] = the four pixels of sources[i], weighted in 1/128 px, rounded: exact integer arithmetic, equal on all
/// targets. Nothing outside the image or beyond `count` pixels of `out` is touched.
using RemapRow = void (*)(const RemapImage& in, const RemapSource* sources, int count, uint8_t* out);

RemapRow remap_row();

}  // namespace takt::stereo
