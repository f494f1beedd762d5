// SPDX-License-Identifier: Apache-2.0
#include "nodes/laser_fusion/clusters.hpp"

#include <algorithm>
#include <numeric>

#include "nodes/laser_fusion/nearest_table.hpp"

namespace takt::laser_fusion {

ClusterFilter::ClusterFilter(size_t points) {
  queue_.reserve(points);
  rest_.reserve(points);
  keep_.reserve(points);
}

void ClusterFilter::begin(std::span<Point> points, const ClusterParameters& parameters) {
  points_ = points;
  parameters_ = parameters;
  keep_.assign(points.size(), 0);
  rest_.resize(points.size());
  std::iota(rest_.begin(), rest_.end(), 0u);
  queue_.clear();
  grown_ = kept_ = 0;
}

bool ClusterFilter::go_on() {
  const auto link2 = static_cast<float>(parameters_.link_m * parameters_.link_m);
  for (size_t compared = 0; compared < kPortion; compared += rest_.size() + 1) {
    if (grown_ == queue_.size()) {
      for (const uint32_t i : queue_) keep_[i] = queue_.size() >= parameters_.least;
      if (rest_.empty()) return conclude();
      queue_.assign(1, rest_.back());
      rest_.pop_back();
      grown_ = 0;
    }
    const Point& from = points_[queue_[grown_++]];
    const auto linked =
        std::partition(rest_.begin(), rest_.end(), [&](uint32_t r) { return !(distance2(from, points_[r]) <= link2); });
    queue_.insert(queue_.end(), linked, rest_.end());
    rest_.erase(linked, rest_.end());
  }
  return false;
}

bool ClusterFilter::conclude() {
  for (size_t i = 0; i < points_.size(); ++i)
    if (keep_[i] != 0) points_[kept_++] = points_[i];
  return true;
}

}  // namespace takt::laser_fusion
