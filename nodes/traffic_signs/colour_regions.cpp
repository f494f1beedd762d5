// SPDX-License-Identifier: Apache-2.0
#include "nodes/traffic_signs/colour_regions.hpp"

#include <algorithm>

namespace takt::traffic_signs {

SignColour colour_of(uint8_t b, uint8_t g, uint8_t r) {
  if (4 * std::min(r, g) >= 5 * b + 8 && 5 * g >= 3 * r) return SignColour::yellow;
  if (5 * r >= 7 * std::max(b, g) + 10) return SignColour::red;
  if (8 * b >= 9 * std::max(r, g) + 16) return SignColour::blue;
  return SignColour::any;
}

ColourRegions::ColourRegions(int width, int height)
    : columns_((width + kCell_px - 1) / kCell_px), rows_((height + kCell_px - 1) / kCell_px) {
  for (auto& sums : sums_) sums.resize(at(0, rows_ + 1));
  for (auto& row : row_) row.resize(static_cast<size_t>(columns_));
}

void ColourRegions::count(ImageView<const uint8_t> bgr) {
  for (int row = 0; row < rows_; ++row) {
    for (auto& cells : row_) std::fill(cells.begin(), cells.end(), 0);
    for (int y = row * kCell_px; y < std::min((row + 1) * kCell_px, bgr.height); ++y) {
      const uint8_t* pixel = bgr.row(y);
      for (int x = 0; x < bgr.width; ++x, pixel += 3) {
        const auto colour = static_cast<size_t>(colour_of(pixel[0], pixel[1], pixel[2]));
        if (colour != 0) ++row_[colour - 1][static_cast<size_t>(x / kCell_px)];
      }
    }
    for (size_t colour = 0; colour < 3; ++colour) {
      int32_t sum = 0;
      for (int column = 0; column < columns_; ++column) {
        sum += row_[colour][static_cast<size_t>(column)];
        sums_[colour][at(column + 1, row + 1)] = sums_[colour][at(column + 1, row)] + sum;
      }
    }
  }
}

int ColourRegions::pixels(SignColour colour, const Box& box) const {
  const auto& sums = sums_[static_cast<size_t>(colour) - 1];
  const int left = box.x / kCell_px, top = box.y / kCell_px,
            right = std::min((box.x + box.width + kCell_px - 1) / kCell_px, columns_),
            bottom = std::min((box.y + box.height + kCell_px - 1) / kCell_px, rows_);
  return sums[at(right, bottom)] - sums[at(left, bottom)] - sums[at(right, top)] + sums[at(left, top)];
}

}  // namespace takt::traffic_signs
