// SPDX-License-Identifier: Apache-2.0
#include "nodes/scan_matching/local_map.hpp"

#include <algorithm>
#include <cmath>

namespace takt::scan_matching {
namespace {

constexpr double kFacing = 0.5;  // cosine of the largest angle between two normals of one surface

/// The nearer of two points to a third, within a gate.
class Nearest {
 public:
  Nearest(const SurfacePoint& point, double gate_m) : point_(point), best_m2_(gate_m * gate_m) {}
  void offer(const SurfacePoint& p) {
    if (p.nx * point_.nx + p.ny * point_.ny < kFacing) return;
    const double dx = p.x_m - point_.x_m, dy = p.y_m - point_.y_m, m2 = dx * dx + dy * dy;
    // Points lie in one array, whatever the order they are offered in.
    if (m2 > best_m2_ || (m2 == best_m2_ && found_ != nullptr && found_ < &p)) return;
    best_m2_ = m2;
    found_ = &p;
  }
  const SurfacePoint* found() const { return found_; }

 private:
  const SurfacePoint& point_;
  double best_m2_;
  const SurfacePoint* found_ = nullptr;
};

}  // namespace

LocalMap::LocalMap(size_t beams, const MapParameters& parameters)
    : p_(parameters),
      most_points_(beams),
      field_(p_.range_max_m + p_.reach_m, p_.cell_m, p_.sigma_m),
      edge_m_(p_.gate_m * (1 + 1e-9)),
      buckets_(2 * static_cast<int>(std::ceil((p_.range_max_m + p_.reach_m) / edge_m_))),
      starts_(static_cast<size_t>(buckets_) * static_cast<size_t>(buckets_) + 1) {
  const size_t most = static_cast<size_t>(p_.keyframes) * beams;
  points_.reserve(most);
  order_.resize(most);
  counts_.reserve(static_cast<size_t>(p_.keyframes));
}

void LocalMap::add(const PlanarPose& robot_in_map, std::span<const SurfacePoint> points) {
  if (counts_.size() == static_cast<size_t>(p_.keyframes)) {
    points_.erase(points_.begin(), points_.begin() + static_cast<ptrdiff_t>(counts_.front()));
    counts_.erase(counts_.begin());
  }
  points = points.first(std::min(points.size(), most_points_));
  for (const SurfacePoint& p : points) points_.push_back(transformed(robot_in_map, p));
  counts_.push_back(points.size());
  lay_out(robot_in_map.x_m, robot_in_map.y_m);
}

void LocalMap::lay_out(double x_m, double y_m) {
  middle_x_m_ = x_m;
  middle_y_m_ = y_m;
  field_.draw(points_, x_m, y_m);
  x0_m_ = x_m - buckets_ / 2.0 * edge_m_;
  y0_m_ = y_m - buckets_ / 2.0 * edge_m_;
  sort_into_buckets();
}

void LocalMap::remember(StateArchive& archive) {
  TAKT_STATE(archive, points_, counts_, middle_x_m_, middle_y_m_);
  if (archive.loads() && points_.size() > order_.size()) archive.fail();
  if (archive.loads() && !archive.failed() && !empty()) lay_out(middle_x_m_, middle_y_m_);
}

void LocalMap::clear() {
  points_.clear();
  counts_.clear();
}

bool LocalMap::in_buckets(const SurfacePoint& p) const {
  const int column = bucket(p.x_m - x0_m_), row = bucket(p.y_m - y0_m_);
  return p.has_normal() && std::min(column, row) >= 0 && std::max(column, row) < buckets_;
}

size_t LocalMap::bucket_of(const SurfacePoint& p) const {
  return static_cast<size_t>(bucket(p.y_m - y0_m_)) * static_cast<size_t>(buckets_) +
         static_cast<size_t>(bucket(p.x_m - x0_m_));
}

void LocalMap::sort_into_buckets() {
  std::fill(starts_.begin(), starts_.end(), 0u);
  for (const SurfacePoint& p : points_)
    if (in_buckets(p)) ++starts_[bucket_of(p)];
  uint32_t end = 0;
  for (uint32_t& start : starts_)
    start = end += start;  // the end of each bucket; filling it from the back moves that to its start
  for (size_t i = points_.size(); i-- > 0;)
    if (in_buckets(points_[i])) order_[--starts_[bucket_of(points_[i])]] = static_cast<uint32_t>(i);
}

const SurfacePoint* LocalMap::nearest(const SurfacePoint& point) const {
  Nearest nearest(point, p_.gate_m);
  const int column = bucket(point.x_m - x0_m_), row = bucket(point.y_m - y0_m_);
  const int first = std::max(column - 1, 0), last = std::min(column + 1, buckets_ - 1);
  if (first > last) return nullptr;
  for (int r = std::max(row - 1, 0); r <= std::min(row + 1, buckets_ - 1); ++r) {
    const size_t bucket = static_cast<size_t>(r) * static_cast<size_t>(buckets_);
    const uint32_t end = starts_[bucket + static_cast<size_t>(last) + 1];
    for (uint32_t i = starts_[bucket + static_cast<size_t>(first)]; i < end; ++i) nearest.offer(points_[order_[i]]);
  }
  return nearest.found();
}

const SurfacePoint* LocalMap::nearest_reference(const SurfacePoint& point) const {
  Nearest nearest(point, p_.gate_m);
  for (const SurfacePoint& p : points_)
    if (in_buckets(p)) nearest.offer(p);
  return nearest.found();
}

}  // namespace takt::scan_matching
