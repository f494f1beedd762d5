// SPDX-License-Identifier: Apache-2.0
// nanoflann over points, for suites that measure against a kd-tree.
#pragma once
#include <nanoflann.hpp>
#include <vector>

#include "rt/msg/messages.hpp"

namespace takt::bench {

struct TreePoints {
  const std::vector<Point>& points;
  size_t kdtree_get_point_count() const { return points.size(); }
  float kdtree_get_pt(size_t i, size_t axis) const { return (&points[i].x)[axis]; }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

using KdTree =
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, TreePoints>, TreePoints, 3, uint32_t>;

}  // namespace takt::bench
