// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/mask_sums.hpp"

#include <algorithm>

namespace takt::object_detection {

void MaskSums::take(ImageView<const uint8_t> mask) {
  width_ = mask.width;
  height_ = mask.height;
  std::fill_n(sums_.begin(), width_ + 1, 0u);
  for (int y = 0; y < height_; ++y) {
    uint32_t in_row = sums_[at(0, y + 1)] = 0;
    for (int x = 0; x < width_; ++x) {
      in_row += mask.at(x, y) != 0;
      sums_[at(x + 1, y + 1)] = sums_[at(x + 1, y)] + in_row;
    }
  }
}

bool MaskSums::any(int x0, int y0, int x1, int y1, int image_width, int image_height) const {
  const int left = x0 * width_ / image_width, right = (x1 * width_ + image_width - 1) / image_width;
  const int top = y0 * height_ / image_height, bottom = (y1 * height_ + image_height - 1) / image_height;
  return sums_[at(right, bottom)] + sums_[at(left, top)] != sums_[at(right, top)] + sums_[at(left, bottom)];
}

}  // namespace takt::object_detection
