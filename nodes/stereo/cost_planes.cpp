// SPDX-License-Identifier: Apache-2.0
#include "nodes/stereo/cost_planes.hpp"

#include <algorithm>
#include <cstring>

namespace takt::stereo {

PlaneMaker::PlaneMaker(int width, int height, int channels, CostKind cost)
    : width_(width),
      height_(height),
      channels_(channels),
      cost_(cost),
      kernels_(&image_kernels()),
      scratch_(static_cast<size_t>(width + kRowPadding)) {
  if (on_grey()) grey_ = Rows<uint8_t>(height, width);
}

Planes PlaneMaker::planes(int depth) const {
  Planes all;
  for (int i = 0; i < count(); ++i) all[static_cast<size_t>(i)] = Rows<uint8_t>(height_, width_, depth);
  return all;
}

void PlaneMaker::make_grey(ImageView<const uint8_t> image) {
  for (int y = 0; y < height_; ++y) {
    uint8_t* row = grey_.row(y);
    if (channels_ == 3) kernels_->grey(image.row(y), width_, row);
    else std::memcpy(row, image.row(y), static_cast<size_t>(width_));
    std::memset(row - kCensusRadius, row[0], kCensusRadius);
    std::memset(row + width_, row[width_ - 1], kCensusRadius);
  }
}

void PlaneMaker::make_row(ImageView<const uint8_t> image, int plane, int y, uint8_t* out) const {
  const auto near = [&](int dy) -> const uint8_t* { return grey_.row(std::clamp(y + dy, 0, height_ - 1)); };
  if (cost_ == CostKind::gradient) {
    if (plane == 0) return kernels_->derivative(near(0) - 1, near(0) + 1, width_, out);
    return kernels_->derivative(near(-1), near(1), width_, out);
  }
  if (cost_ == CostKind::census) {
    const uint8_t* const rows[] = {near(-3), near(-2), near(-1), near(0), near(1), near(2), near(3)};
    return kernels_->census(rows, plane, width_, out);
  }
  kernels_->channel(image.row(y), channels_, plane, width_, cost_ == CostKind::ssd ? 0x80 : 0, out);
}

void PlaneMaker::make(ImageView<const uint8_t> image, bool mirror, Planes& out) {
  if (on_grey()) make_grey(image);
  // A grey image under ssd or sad leaves planes 1 and 2 zero: they then cost nothing.
  const int used = on_grey() ? count() : channels_;
  for (int i = 0; i < used; ++i)
    for (int y = 0; y < height_; ++y) {
      uint8_t* target = out[static_cast<size_t>(i)].row(y);
      uint8_t* row = mirror ? scratch_.data() : target;
      make_row(image, i, y, row);
      if (mirror) kernels_->reverse(row, width_, target);
    }
}

}  // namespace takt::stereo
