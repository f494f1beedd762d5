// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/decision.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace takt::object_detection {
namespace {

bool better(const Detection& a, const Detection& b) {
  return std::tuple(-a.score, a.class_id, a.y_px, a.x_px) < std::tuple(-b.score, b.class_id, b.y_px, b.x_px);
}

}  // namespace

Decision::Decision(const SearchGrid& grid, std::span<const std::vector<ReferenceLimit>> objects) : grid_(grid) {
  for (const auto& references : objects) {
    auto& limits = limits_.emplace_back();
    // missing / mass < threshold, with whole numbers on the left: missing < ceil(threshold * mass)
    for (const ReferenceLimit& reference : references)
      limits.push_back({static_cast<uint32_t>(std::ceil(std::max(0.0, reference.threshold * reference.mass))),
                        static_cast<float>(reference.mass)});
  }
  const auto windows = static_cast<size_t>(grid.windows());
  errors_.resize(windows * objects.size());
  passed_.resize(windows);
  visited_.resize(windows);
  stack_.resize(windows);
}

void Decision::decide(std::span<const uint16_t> missing) {
  const size_t windows = passed_.size(), references = missing.size() / windows;
  for (size_t window = 0; window < windows; ++window) decide_window(window, missing.data() + window * references);
}

void Decision::decide_window(size_t window, const uint16_t* missing) {
  bool any = false;
  for (size_t object = 0; object < limits_.size(); ++object) {
    float best = kFailed;
    for (const Limit& limit : limits_[object]) {
      const uint16_t mass = *missing++;
      if (mass < limit.below) best = std::min(best, static_cast<float>(mass) / limit.mass);
    }
    errors_[object * passed_.size() + window] = best;
    any = any || best < kFailed;
  }
  passed_[window] = any ? 255 : 0;
}

std::span<const float> Decision::errors(size_t object) const {
  return std::span(errors_).subspan(object * passed_.size(), passed_.size());
}

void Decision::region_of_interest(ImageView<uint8_t> roi) const {
  const auto columns = static_cast<size_t>(grid_.columns);
  for (int v = 0; v < grid_.rows; ++v)
    std::copy_n(passed_.data() + static_cast<size_t>(v) * columns, columns, roi.row(v));
}

size_t Decision::passed_windows() const {
  return passed_.size() - static_cast<size_t>(std::count(passed_.begin(), passed_.end(), uint8_t{0}));
}

size_t Decision::detections(double min_score, std::span<Detection> out) {
  size_t found = 0;
  for (size_t object = 0; object < limits_.size(); ++object) {
    const std::span<const float> errors = this->errors(object);
    std::fill(visited_.begin(), visited_.end(), uint8_t{0});
    for (size_t window = 0; window < errors.size(); ++window) {
      if (visited_[window] || errors[window] == kFailed) continue;
      const size_t best = best_of_group(errors, window);
      if (1 - errors[best] < static_cast<float>(min_score)) continue;
      const int u = static_cast<int>(best) % grid_.columns, v = static_cast<int>(best) / grid_.columns;
      const auto size = static_cast<float>(grid_.window_px);
      const Detection detection{static_cast<float>(object),
                                static_cast<float>(grid_.x0(u)),
                                static_cast<float>(grid_.y0(v)),
                                size,
                                size,
                                1 - errors[best]};
      if (found < out.size()) out[found++] = detection;
      else if (auto worst = std::max_element(out.begin(), out.end(), better);
               worst != out.end() && better(detection, *worst))
        *worst = detection;
    }
  }
  std::sort(out.begin(), out.begin() + static_cast<ptrdiff_t>(found), better);
  return found;
}

/// Marks the group of touching windows around `seed` as visited.
size_t Decision::best_of_group(std::span<const float> errors, size_t seed) {
  size_t best = seed, open = 0;
  const auto columns = static_cast<size_t>(grid_.columns);
  visited_[seed] = 1;
  stack_[open++] = static_cast<uint32_t>(seed);
  while (open > 0) {
    const size_t window = stack_[--open];
    if (std::pair(errors[window], window) < std::pair(errors[best], best)) best = window;
    const int u = static_cast<int>(window % columns), v = static_cast<int>(window / columns);
    for (int y = std::max(0, v - 1); y <= std::min(grid_.rows - 1, v + 1); ++y) {
      for (int x = std::max(0, u - 1); x <= std::min(grid_.columns - 1, u + 1); ++x) {
        const size_t next = static_cast<size_t>(y) * columns + static_cast<size_t>(x);
        if (visited_[next] || errors[next] == kFailed) continue;
        visited_[next] = 1;
        stack_[open++] = static_cast<uint32_t>(next);
      }
    }
  }
  return best;
}

}  // namespace takt::object_detection
