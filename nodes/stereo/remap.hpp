// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "nodes/stereo/debayer.hpp"
#include "rt/msg/image_view.hpp"

namespace takt::stereo {

/// Where a pixel comes from: upper left of the four source pixels and the fractions in 1/128 px (0..128).
struct RemapSource {
  int16_t x = -1, y = -1;  ///< -1: outside, gives 0
  uint8_t fraction_x = 0, fraction_y = 0;
};

/// Bilinear resampling of whole images through one table, in exact integer arithmetic (remap_reference.hpp is the
/// definition). Source rows pass once through a window of as many rows as the table needs at a time; there they are
/// debayered, if they are a mosaic. The window is the caller's, so that tables used one after the other share a cache.
class Remap {
 public:
  Remap() = default;
  /// `sources`: width x height, row by row; x in -1 .. width - 2, y in -1 .. height - 2, both at least 2.
  Remap(int width, int height, std::span<const RemapSource> sources);

  size_t window_bytes() const;
  /// `in` and `out` have the size of the table; `in` 1 or 3 channels, 1 if there is a pattern; `out` the same, 3 if
  /// there is one. `window` has window_bytes(). Not checked.
  void run(ImageView<const uint8_t> in, BayerPattern pattern, std::span<int8_t> window, ImageView<uint8_t> out) const;

 private:
  int width_ = 0, height_ = 0;
  int window_rows_ = 0, row_pixels_ = 0, padded_width_ = 0;
  std::vector<int> needed_rows_;     ///< by row: source rows that must have passed before it can be made
  std::vector<uint32_t> offsets_;    ///< by pixel, rows padded: place of the source in the window
  std::vector<uint16_t> fractions_;  ///< fraction_x, and fraction_y in the high byte
};

}  // namespace takt::stereo
