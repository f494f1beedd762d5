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

size_t ClusterFilter::filter(std::span<Point> points, const ClusterParameters& p) {
  const auto link2 = static_cast<float>(p.link_m * p.link_m);
  keep_.assign(points.size(), 0);
  rest_.resize(points.size());
  std::iota(rest_.begin(), rest_.end(), 0u);
  while (!rest_.empty()) {
    queue_.assign(1, rest_.back());
    rest_.pop_back();
    for (size_t i = 0; i < queue_.size(); ++i) {
      const Point& from = points[queue_[i]];
      const auto linked = std::partition(rest_.begin(), rest_.end(),
                                         [&](uint32_t r) { return !(distance2(from, points[r]) <= link2); });
      queue_.insert(queue_.end(), linked, rest_.end());
      rest_.erase(linked, rest_.end());
    }
    for (const uint32_t i : queue_) keep_[i] = queue_.size() >= p.least;
  }
  size_t kept = 0;
  for (size_t i = 0; i < points.size(); ++i)
    if (keep_[i] != 0) points[kept++] = points[i];
  return kept;
}

}  // namespace takt::laser_fusion
