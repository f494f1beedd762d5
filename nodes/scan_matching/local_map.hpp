// SPDX-License-Identifier: Apache-2.0
// The last few scans at their poses: what the next scan is matched with.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "nodes/scan_matching/score_field.hpp"
#include "rt/state_archive.hpp"

namespace takt::scan_matching {

struct MapParameters {
  int keyframes = 20;       ///< the oldest makes room
  double range_max_m = 15;  ///< of the points that are added
  double reach_m = 3;       ///< how far the robot may be from the last keyframe
  double cell_m = 0.05;     ///< of the score field
  double sigma_m = 0.10;    ///< of the score field
  double gate_m = 0.30;     ///< points farther apart are not the same surface
};

/// Memory is taken by the constructor and does not grow; places beyond range_max_m + reach_m of the last keyframe
/// (along an axis) are forgotten until one is near again. One thread at a time.
class LocalMap {
 public:
  /// For scans of at most `beams` points.
  LocalMap(size_t beams, const MapParameters& parameters);

  /// Adds a scan (robot frame) and makes the robot's place the middle of the map.
  void add(const PlanarPose& robot_in_map, std::span<const SurfacePoint> points);
  void clear();
  bool empty() const { return counts_.empty(); }

  const ScoreField& field() const { return field_; }
  /// Of all keyframes, oldest first, map frame.
  std::span<const SurfacePoint> points() const { return points_; }

  /// The nearest mapped point within gate_m whose surface is seen from the same side and turned by at most 60 degrees;
  /// of equally near ones the first. Null if there is none. Both places are in the map frame, both need a normal.
  const SurfacePoint* nearest(const SurfacePoint& point) const;
  /// The same by looking at every point.
  const SurfacePoint* nearest_reference(const SurfacePoint& point) const;
  void remember(StateArchive& archive);

 private:
  int bucket(double offset_m) const { return static_cast<int>(std::floor(offset_m / edge_m_)); }
  bool in_buckets(const SurfacePoint& p) const;
  size_t bucket_of(const SurfacePoint& p) const;
  void sort_into_buckets();
  /// Makes what follows from the points: field and buckets about that place.
  void lay_out(double x_m, double y_m);

  MapParameters p_;
  size_t most_points_;  ///< of one keyframe
  ScoreField field_;
  std::vector<SurfacePoint> points_;
  std::vector<size_t> counts_;  ///< points of each keyframe
  double edge_m_;               ///< of a bucket; not less than the gate
  int buckets_;                 ///< along an edge
  double middle_x_m_ = 0, middle_y_m_ = 0, x0_m_ = 0, y0_m_ = 0;
  std::vector<uint32_t> starts_, order_;  ///< order_[starts_[b] .. starts_[b + 1]): points in bucket b
};

}  // namespace takt::scan_matching
