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
constexpr size_t kPointsAtOnce = 128, kVoxelsAtOnce = size_t{1} << 16;  // of a portion

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
  begin(points, reach_m, divisions);
  while (!go_on()) {
  }
}

void NearestTable::set_reach(double reach_m, int divisions) {
  begin_reach(reach_m, divisions);
  while (!go_on()) {
  }
}

void NearestTable::begin(std::span<const Point> points, double reach_m, int divisions) {
  points_.assign(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(std::min(points.size(), capacity_)));
  begin_reach(reach_m, divisions);
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

void NearestTable::begin_reach(double reach_m, int divisions) {
  reach_m_ = reach_m;
  bounds_ = cloud::bounds_of(points_, cloud::kFarthest_m);
  if (bounds_.points == 0) bounds_ = {};
  farthest_m_ = reach_m;
  for (size_t a = 0; a < 3; ++a)
    farthest_m_ = std::max({farthest_m_, std::abs(double{bounds_.low[a]}), std::abs(double{bounds_.high[a]})});
  divide(std::max(reach_m / divisions, kLeastEdge * farthest_m_));
}

/// Into voxels of that edge, or of the next one of which there are not too many; every pass is then to be done.
void NearestTable::divide(double edge_m) {
  while (!lay_out(edge_m)) edge_m *= kCoarser;
  start_[voxels_] = start_[voxels_ + 1] = 0;
  pass_ = Pass::clear;
  next_ = 0;
  listed_ = 0;
}

/// False if there are too many voxels.
bool NearestTable::lay_out(double edge_m) {
  edge_m_ = edge_m;
  per_m_ = static_cast<float>(1 / edge_m);
  slack_m_ = kSlack * static_cast<float>(edge_m) + kRounding * static_cast<float>(farthest_m_);
  double voxels = 1;
  for (size_t a = 0; a < 3; ++a) {
    origin_[a] =
        static_cast<float>(bounds_.low[a] - reach_m_ - edge_m);  // a margin of one voxel: rounding loses no place
    const double cells = std::ceil((bounds_.high[a] + reach_m_ + edge_m - origin_[a]) / edge_m);
    voxels *= cells;
    if (voxels > static_cast<double>(most_voxels_)) return false;
    count_[a] = static_cast<size_t>(cells);
    size_[a] = static_cast<float>(cells);
  }
  voxels_ = static_cast<size_t>(voxels);
  return true;
}

bool NearestTable::go_on() {
  if (pass_ == Pass::done) return true;
  const bool of_points = pass_ == Pass::bound || pass_ == Pass::count || pass_ == Pass::fill;
  const size_t all = of_points ? points_.size() : voxels_;
  const size_t last = std::min(all, next_ + (of_points ? kPointsAtOnce : kVoxelsAtOnce));
  if (of_points) pass_points(next_, last);
  else pass_voxels(next_, last);
  next_ = last;
  if (last < all) return false;
  if (pass_ == Pass::sum && listed_ >= entries_.size()) {  // one past the last is prefetched
    divide(kCoarser * edge_m_);
    return false;
  }
  next_ = 0;
  pass_ = static_cast<Pass>(static_cast<uint8_t>(pass_) + 1);
  return pass_ == Pass::done;
}

void NearestTable::pass_voxels(size_t first, size_t last) {
  const auto reach2 = static_cast<float>(reach_m_ * reach_m_);
  for (size_t v = first; v < last; ++v) {
    if (pass_ == Pass::clear) {
      bound2_[v] = reach2;
      start_[v] = 0;
    } else if (pass_ == Pass::widen) {
      bound2_[v] = bound2_[v] * (1 + kSlack) + slack_m_ * slack_m_;
    } else {
      listed_ += start_[v + 2];
      start_[v + 2] = static_cast<uint32_t>(std::min<uint64_t>(listed_, UINT32_MAX));
    }
  }
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
void NearestTable::for_each_voxel(const Point& point, const Visit& visit) const {
  const Span x = span_of(point.x, 0), y = span_of(point.y, 1), z = span_of(point.z, 2);
  for (int k = 0; k < z.count; ++k)
    for (int j = 0; j < y.count; ++j) {
      const size_t row =
          ((z.first + static_cast<size_t>(k)) * count_[1] + y.first + static_cast<size_t>(j)) * count_[0] + x.first;
      const float near2 = z.near2[k] + y.near2[j], far2 = z.far2[k] + y.far2[j];
      for (int i = 0; i < x.count; ++i) visit(row + static_cast<size_t>(i), near2 + x.near2[i], far2 + x.far2[i]);
    }
}

/// Entries are counted two places on, then filled one place on: in the end start_[v] is where the list of v begins, and
/// that of voxels_, everything outside, is empty.
void NearestTable::pass_points(size_t first, size_t last) {
  for (size_t p = first; p < last; ++p) {
    if (!cloud::usable(points_[p])) continue;
    if (pass_ == Pass::bound)
      for_each_voxel(points_[p], [&](size_t v, float, float far2) { bound2_[v] = std::min(bound2_[v], far2); });
    else if (pass_ == Pass::count)
      for_each_voxel(points_[p], [&](size_t v, float near2, float) { start_[v + 2] += near2 <= bound2_[v] ? 1 : 0; });
    else
      for_each_voxel(points_[p], [&](size_t v, float near2, float) {
        if (near2 <= bound2_[v]) entries_[start_[v + 1]++] = static_cast<uint32_t>(p);
      });
  }
}

}  // namespace takt::laser_fusion
