// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/layout_stage.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace takt::object_detection {
namespace {

/// Of the squares around a window: the largest one, and as many steps to either side.
int reach_px(int largest_side, int steps, int step_px) { return largest_side + 2 * steps * step_px + 2; }

}  // namespace

float LayoutTemplate::evidence(const LayoutFeatures& features) const {
  int32_t sum = 0;
  for (size_t i = 0; i < kLayoutFeatures; ++i) sum += static_cast<int32_t>(weight[i]) * features[i];
  return unit * static_cast<float>(sum - middle);
}

LayoutStage::LayoutStage(const SearchGrid& grid, int reference_px, std::vector<LayoutObject> objects)
    : grid_(grid),
      step_px_(std::max(1, (grid.window_px - reference_px) / 4)),
      objects_(std::move(objects)),
      sums_(reach_px(static_cast<int>(std::lround(kSides.back() * reference_px)), kSteps, step_px_),
            reach_px(static_cast<int>(std::lround(kSides.back() * reference_px)), kSteps, step_px_)) {
  for (size_t i = 0; i < sides_.size(); ++i) sides_[i] = static_cast<int>(std::lround(kSides[i] * reference_px));
  if (sides_.back() > std::min(grid.image_width, grid.image_height))
    throw std::invalid_argument("the layout of views is looked for at up to " + std::to_string(sides_.back()) +
                                " px, the image has " + std::to_string(grid.image_width) + " x " +
                                std::to_string(grid.image_height));
}

template <class Act>
void LayoutStage::for_each_placement(size_t window, const Act& act) const {
  const auto u = static_cast<int>(window) % grid_.columns, v = static_cast<int>(window) / grid_.columns;
  const int middle_x = grid_.x0(u) + grid_.window_px / 2, middle_y = grid_.y0(v) + grid_.window_px / 2;
  for (const int side : sides_) {
    for (int j = -kSteps; j <= kSteps; ++j) {
      const int y = std::clamp(middle_y + j * step_px_ - side / 2, 0, grid_.image_height - side);
      for (int i = -kSteps; i <= kSteps; ++i)
        act(Placement{std::clamp(middle_x + i * step_px_ - side / 2, 0, grid_.image_width - side), y, side});
    }
  }
}

std::vector<Placement> LayoutStage::placements(size_t window) const {
  std::vector<Placement> all;
  for_each_placement(window, [&](const Placement& at) { all.push_back(at); });
  return all;
}

LayoutStage::Fit LayoutStage::best(ImageView<const uint8_t> bgr, size_t window, size_t object) {
  int left = grid_.image_width, top = grid_.image_height, right = 0, bottom = 0;
  for_each_placement(window, [&](const Placement& at) {
    left = std::min(left, at.x);
    top = std::min(top, at.y);
    right = std::max(right, at.x + at.side);
    bottom = std::max(bottom, at.y + at.side);
  });
  sums_.take(bgr, left, top, right - left, bottom - top);
  float most = -std::numeric_limits<float>::infinity();
  Fit best;
  for_each_placement(window, [&](const Placement& at) {
    sums_.features(at, features_);
    for (const LayoutTemplate& view : objects_[object].views)
      if (const float evidence = view.evidence(features_); evidence > most) most = evidence, best.at = at;
  });
  best.error = layout_error(most);
  return best;
}

}  // namespace takt::object_detection
