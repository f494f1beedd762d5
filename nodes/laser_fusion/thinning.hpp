// SPDX-License-Identifier: Apache-2.0
// From clouds of sensors to the few, evenly spread points that a search works with.
#pragma once
#include <span>

#include "nodes/cloud/voxel_grid.hpp"
#include "rt/msg/point.hpp"

namespace takt::laser_fusion {

/// thin_out() in portions: a pass over the cloud each.
class Thinning {
 public:
  /// Cloud and memory stay where they are until go_on() says true.
  void begin(const cloud::CloudView& cloud, double edge_m, const cloud::CloudBuffer& out);
  /// One pass; true once `out` is filled.
  bool go_on(cloud::VoxelGrid& grid);
  size_t size() const { return out_.size(); }
  double edge_m() const { return edge_m_; }  ///< of the voxels, 0 if none were needed

 private:
  cloud::CloudView cloud_;
  cloud::CloudBuffer out_{{}, {}};
  double edge_m_ = 0;
  bool counted_ = false;
};

/// Fills `out` with at most out.capacity() points of the cloud: as they are if they are few enough, else the mean point
/// of each voxel, whose edge is about the least one from `edge_m` on that makes them few enough. Points that are not
/// usable() are left out. The grid holds as many points as the cloud has. Returns the edge, 0 if none was needed.
double thin_out(const cloud::CloudView& cloud, double edge_m, cloud::VoxelGrid& grid, cloud::CloudBuffer& out);

/// Median distance from a point to the nearest other one, m; 0 for less than two. Of a large cloud it looks at some
/// hundred points, evenly chosen. For tools: allocates.
double spacing_of(std::span<const Point> points);

}  // namespace takt::laser_fusion
