// SPDX-License-Identifier: Apache-2.0
#include "nodes/laser_fusion/nearest_table.hpp"

#include <algorithm>
#include <cmath>

namespace takt::laser_fusion {
namespace {

constexpr size_t kEntriesPerVoxel = 4, kEntriesPerPoint = 32;
constexpr double kCoarser = 1.26;  // half as many voxels
// Bounds are widened by more than the rounding of the places that are looked up and of the distances compared.
constexpr float kSlack = 1e-4f, kRounding = 2e-6f;
constexpr double kLeastEdge = 1e-4;  // of the farthest coordinate: beside it the slack is small

}  // namespace

Nearest nearest_reference(std::span<const Point> points, const Point& place) {
  Nearest best;
  for (uint32_t i = 0; i < points.size(); ++i)
    if (cloud::usable(points[i])) best.consider(i, distance2(place, points[i]));
  return best;
}

NearestTable::NearestTable(size_t points, size_t voxels) : capacity_(points), most_voxels_(voxels) {
  points_.reserve(points);
  bound2_.resize(voxels);
  start_.resize(voxels + 2);
  entries_.resize(kEntriesPerVoxel * voxels + kEntriesPerPoint * points);
}

void NearestTable::build(std::span<const Point> points, double reach_m, int divisions) {
  points_.assign(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(std::min(points.size(), capacity_)));
  set_reach(reach_m, divisions);
}

void NearestTable::nearest(const IntoChild& into_child, std::span<const Point> points,
                           std::span<Nearest> nearest) const {
  // Step by step for a block of places: what one of them waits for from the caches, others wait for at the same time.
  constexpr size_t kBlock = 64;
  Point place[kBlock];
  size_t voxel[kBlock];
  for (size_t first = 0; first < points.size(); first += kBlock) {
    const size_t count = std::min(kBlock, points.size() - first);
    for (size_t i = 0; i < count; ++i) {
      place[i] = into_child(points[first + i]);
      voxel[i] = voxel_of(place[i]);
      __builtin_prefetch(&start_[voxel[i]]);
    }
    for (size_t i = 0; i < count; ++i) __builtin_prefetch(&entries_[start_[voxel[i]]]);
    for (size_t i = 0; i < count; ++i) nearest[first + i] = nearest_in(voxel[i], place[i]);
  }
}

void NearestTable::set_reach(double reach_m, int divisions) {
  reach_m_ = reach_m;
  cloud::Bounds bounds = cloud::bounds_of(points_, cloud::kFarthest_m);
  if (bounds.points == 0) bounds = {};
  double farthest_m = reach_m;
  for (size_t a = 0; a < 3; ++a)
    farthest_m = std::max({farthest_m, std::abs(double{bounds.low[a]}), std::abs(double{bounds.high[a]})});
  for (double edge_m = std::max(reach_m / divisions, kLeastEdge * farthest_m);; edge_m *= kCoarser) {
    slack_m_ = kSlack * static_cast<float>(edge_m) + kRounding * static_cast<float>(farthest_m);
    if (lay_out(bounds, edge_m) && list()) return;
  }
}

/// False if there are too many voxels.
bool NearestTable::lay_out(const cloud::Bounds& bounds, double edge_m) {
  edge_m_ = edge_m;
  per_m_ = static_cast<float>(1 / edge_m);
  double voxels = 1;
  for (size_t a = 0; a < 3; ++a) {
    origin_[a] =
        static_cast<float>(bounds.low[a] - reach_m_ - edge_m);  // a margin of one voxel: rounding loses no place
    const double cells = std::ceil((bounds.high[a] + reach_m_ + edge_m - origin_[a]) / edge_m);
    voxels *= cells;
    if (voxels > static_cast<double>(most_voxels_)) return false;
    count_[a] = static_cast<size_t>(cells);
    size_[a] = static_cast<float>(cells);
  }
  voxels_ = static_cast<size_t>(voxels);
  return true;
}

NearestTable::Span NearestTable::span_of(float coordinate, size_t axis) const {
  const auto reach = static_cast<float>(reach_m_) + slack_m_, edge = static_cast<float>(edge_m_);
  const float first = std::floor((coordinate - reach - origin_[axis]) * per_m_);
  const float last = std::floor((coordinate + reach - origin_[axis]) * per_m_);
  Span span;
  span.first = static_cast<size_t>(std::max(first, 0.0f));
  const float end = std::min(last + 1, size_[axis]);
  span.count = std::min(static_cast<int>(end) - static_cast<int>(span.first), Span::kMost);
  for (int i = 0; i < span.count; ++i) {
    const float low = origin_[axis] + static_cast<float>(span.first + static_cast<size_t>(i)) * edge - slack_m_;
    const float high = low + edge + 2 * slack_m_;
    const float near = std::max({0.0f, low - coordinate, coordinate - high});
    const float far = std::max(coordinate - low, high - coordinate);
    span.near2[i] = near * near;
    span.far2[i] = far * far;
  }
  return span;
}

template <class Visit>
void NearestTable::for_each_voxel(const Point& point, const Visit& visit) {
  const Span x = span_of(point.x, 0), y = span_of(point.y, 1), z = span_of(point.z, 2);
  for (int k = 0; k < z.count; ++k)
    for (int j = 0; j < y.count; ++j) {
      const size_t row =
          ((z.first + static_cast<size_t>(k)) * count_[1] + y.first + static_cast<size_t>(j)) * count_[0] + x.first;
      const float near2 = z.near2[k] + y.near2[j], far2 = z.far2[k] + y.far2[j];
      for (int i = 0; i < x.count; ++i) visit(row + static_cast<size_t>(i), near2 + x.near2[i], far2 + x.far2[i]);
    }
}

/// False if there are too many entries.
bool NearestTable::list() {
  const auto reach2 = static_cast<float>(reach_m_ * reach_m_);
  const auto for_each_point = [&](const auto& visit) {
    for (uint32_t p = 0; p < points_.size(); ++p)
      if (cloud::usable(points_[p]))
        for_each_voxel(points_[p], [&](size_t voxel, float near2, float far2) { visit(p, voxel, near2, far2); });
  };
  std::fill_n(bound2_.begin(), voxels_, reach2);
  for_each_point([&](uint32_t, size_t v, float, float far2) { bound2_[v] = std::min(bound2_[v], far2); });
  for (size_t v = 0; v < voxels_; ++v) bound2_[v] = bound2_[v] * (1 + kSlack) + slack_m_ * slack_m_;

  // Counted two places on, then filled one place on: in the end start_[v] is where the list of v begins, and that of
  // voxels_, everything outside, is empty.
  std::fill_n(start_.begin(), voxels_ + 2, 0u);
  for_each_point([&](uint32_t, size_t v, float near2, float) { start_[v + 2] += near2 <= bound2_[v] ? 1 : 0; });
  uint64_t entries = 0;
  for (size_t v = 0; v < voxels_; ++v) {
    entries += start_[v + 2];
    start_[v + 2] = static_cast<uint32_t>(std::min<uint64_t>(entries, UINT32_MAX));
  }
  if (entries >= entries_.size()) return false;  // one past the last is prefetched
  for_each_point([&](uint32_t p, size_t v, float near2, float) {
    if (near2 <= bound2_[v]) entries_[start_[v + 1]++] = p;
  });
  return true;
}

}  // namespace takt::laser_fusion
