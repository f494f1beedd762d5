// SPDX-License-Identifier: Apache-2.0
#include "nodes/scan_matching/score_field.hpp"

#include <algorithm>
#include <cmath>

namespace takt::scan_matching {

ScoreField::ScoreField(double half_m, double cell_m, double sigma_m)
    : cell_m_(cell_m),
      blocks_(2 * static_cast<int>(std::ceil(half_m / (cell_m * kBlock)))),
      cells_(blocks_ * kBlock),
      radius_(static_cast<int>(3 * sigma_m / cell_m)),
      values_(static_cast<size_t>(cells_) * static_cast<size_t>(cells_)),
      bounds_(static_cast<size_t>(blocks_) * static_cast<size_t>(blocks_)),
      highest_(static_cast<size_t>(cells_)) {
  const double scale = cell_m / sigma_m;
  for (int y = -radius_; y <= radius_; ++y)
    for (int x = -radius_; x <= radius_; ++x) {
      const double d2 = (x * x + y * y) * scale * scale;
      kernel_.push_back(d2 > 9 ? uint8_t{0} : static_cast<uint8_t>(std::lround(255 * std::exp(-d2 / 2))));
    }
}

void ScoreField::draw(std::span<const SurfacePoint> points, double x_m, double y_m) {
  x0_m_ = (std::floor(x_m / cell_m_) - cells_ / 2.0) * cell_m_;
  y0_m_ = (std::floor(y_m / cell_m_) - cells_ / 2.0) * cell_m_;
  std::fill(values_.begin(), values_.end(), uint8_t{0});
  const int width = 2 * radius_ + 1;
  for (const SurfacePoint& p : points) {
    const int column = this->column(p.x_m), row = this->row(p.y_m);
    if (std::min(column, row) < radius_ || std::max(column, row) >= cells_ - radius_) continue;
    const uint8_t* from = kernel_.data();
    for (int y = row - radius_; y <= row + radius_; ++y, from += width) {
      uint8_t* to = &values_[index(cells_, column - radius_, y)];
      for (int x = 0; x < width; ++x) to[x] = std::max(to[x], from[x]);
    }
  }
  find_bounds();
}

void ScoreField::find_bounds() {
  for (int block_row = 0; block_row < blocks_; ++block_row) {
    std::fill(highest_.begin(), highest_.end(), uint8_t{0});
    const int end = std::min((block_row + 2) * kBlock, cells_);
    for (int row = block_row * kBlock; row < end; ++row) {
      const uint8_t* from = cell(0, row);
      for (size_t x = 0; x < highest_.size(); ++x) highest_[x] = std::max(highest_[x], from[x]);
    }
    for (int block = 0; block < blocks_; ++block)
      bounds_[index(blocks_, block, block_row)] = *std::max_element(
          highest_.begin() + block * kBlock, highest_.begin() + std::min((block + 2) * kBlock, cells_));
  }
}

}  // namespace takt::scan_matching
