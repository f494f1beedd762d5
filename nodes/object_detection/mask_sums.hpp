// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "rt/msg/image_view.hpp"

namespace takt::object_detection {

/// Says of any rectangle of an image whether a mask of it, of any size, has something there. Memory is taken by the
/// constructor. One thread at a time.
class MaskSums {
 public:
  explicit MaskSums(size_t most_pixels) : sums_(2 * most_pixels + 2) {}

  /// Takes the pixels that are not 0. `mask`: one channel, at least 1 x 1, at most the constructor's pixels (not
  /// checked).
  void take(ImageView<const uint8_t> mask);
  /// Any in [x0, x1) x [y0, y1) of an image of that size, which the mask covers as a whole? A pixel of the mask counts
  /// where any of it lies in the rectangle.
  bool any(int x0, int y0, int x1, int y1, int image_width, int image_height) const;

 private:
  size_t at(int x, int y) const {
    return static_cast<size_t>(y) * (static_cast<size_t>(width_) + 1) + static_cast<size_t>(x);
  }

  int width_ = 0, height_ = 0;
  std::vector<uint32_t> sums_;  ///< at (x, y) how many are left of and above it; (w + 1) (h + 1) <= 2 w h + 2
};

}  // namespace takt::object_detection
