// SPDX-License-Identifier: Apache-2.0
// nanoflann's kd-tree over points, as a peer.
#pragma once
#include <nanoflann.hpp>
#include <span>

#include "rt/msg/point.hpp"

namespace takt::bench {

/// For nanoflann.
struct KdTreePoints {
  std::span<const Point> points;
  size_t kdtree_get_point_count() const { return points.size(); }
  float kdtree_get_pt(size_t i, size_t axis) const { return (&points[i].x)[axis]; }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

using KdTree =
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, KdTreePoints>, KdTreePoints, 3, uint32_t>;

}  // namespace takt::bench
