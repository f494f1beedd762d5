// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/decision.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <tuple>

namespace takt::object_detection {

bool better(const Detection& a, const Detection& b) {
  return std::tuple(-a.score, a.class_id, a.y_px, a.x_px) < std::tuple(-b.score, b.class_id, b.y_px, b.x_px);
}

StageLimits::StageLimits(std::span<const std::vector<ReferenceLimit>> objects) {
  for (const auto& references : objects) {
    auto& limits = limits_.emplace_back();
    // missing / mass < threshold, with whole numbers on the left: missing < ceil(threshold * mass)
    for (const ReferenceLimit& reference : references)
      limits.push_back(reference.mass == 0 ? Limit{1, 1.0f}
                                           : Limit{static_cast<uint32_t>(
                                                       std::ceil(std::max(0.0, reference.threshold * reference.mass))),
                                                   static_cast<float>(reference.mass)});
  }
}

Decision::Decision(const SearchGrid& grid, size_t objects)
    : grid_(grid), windows_(static_cast<size_t>(grid.windows())) {
  errors_.assign(windows_ * objects, kFailed);
  at_.resize(errors_.size());
  visited_.resize(windows_);
  stack_.resize(windows_);
}

void Decision::clear() { std::fill(errors_.begin(), errors_.end(), kFailed); }

bool Decision::passes(size_t window) const {
  for (size_t i = window; i < errors_.size(); i += windows_)
    if (errors_[i] < kFailed) return true;
  return false;
}

void Decision::region_of_interest(ImageView<uint8_t> roi) const {
  size_t window = 0;
  for (int v = 0; v < grid_.rows; ++v)
    for (int u = 0; u < grid_.columns; ++u) roi.at(u, v) = passes(window++) ? 255 : 0;
}

size_t Decision::passed_windows() const {
  size_t passed = 0;
  for (size_t window = 0; window < windows_; ++window) passed += passes(window);
  return passed;
}

size_t Decision::detections(double min_score, std::span<Detection> out) {
  size_t found = 0;
  for (size_t object = 0; object < objects(); ++object) {
    const std::span<const float> errors = this->errors(object);
    std::fill(visited_.begin(), visited_.end(), uint8_t{0});
    for (size_t window = 0; window < errors.size(); ++window) {
      if (visited_[window] || errors[window] == kFailed) continue;
      const size_t best = best_of_group(errors, window);
      if (1 - errors[best] < static_cast<float>(min_score)) continue;
      const Detection detection = this->detection(object, best);
      if (found < out.size()) out[found++] = detection;
      else if (auto worst = std::max_element(out.begin(), out.end(), better);
               worst != out.end() && better(detection, *worst))
        *worst = detection;
    }
  }
  std::sort(out.begin(), out.begin() + static_cast<ptrdiff_t>(found), better);
  return found;
}

Detection Decision::detection(size_t object, size_t best) const {
  const std::span<const float> errors = this->errors(object);
  const Placement& at = at_[object * windows_ + best];
  const Placement middle = grid_.window(best);
  const auto near = [&](int origin, int of_best) { return 2 * std::abs(origin - of_best) <= grid_.window_px; };
  float x = 0, y = 0, weights = 0;
  for (int v = 0; v < grid_.rows; ++v) {
    if (!near(grid_.y0(v), middle.y)) continue;
    for (int u = 0; u < grid_.columns; ++u) {
      const auto window = static_cast<size_t>(v * grid_.columns + u);
      const float weight = errors[best] + kNearlyBest - errors[window];
      const Placement& other = at_[object * windows_ + window];
      if (weight <= 0 || !near(grid_.x0(u), middle.x) || other.side != at.side) continue;
      x += weight * static_cast<float>(other.x);
      y += weight * static_cast<float>(other.y);
      weights += weight;
    }
  }
  const auto side = static_cast<float>(at.side);
  return {static_cast<float>(object), x / weights, y / weights, side, side, 1 - errors[best]};
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
