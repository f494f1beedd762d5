// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cmath>

#include "nodes/mapping_3d/pose.hpp"
#include "rt/msg/laser_scan.hpp"
#include "rt/msg/point.hpp"

namespace takt::laser_cloud {

/// Adds the returns of a sweep up to range_max_m, moved by `to_cloud` from the scanner's frame (x right, y forward, z
/// up; angles counter-clockwise from y), as long as there is room.
inline void add_points(const LaserScan& scan, const mapping_3d::Affine& to_cloud, double range_max_m,
                       Array<Point>& points) {
  for (uint32_t beam = 0; beam < scan.range_m.size; ++beam) {
    const double range = scan.range_m[beam];
    if (!(range > 0) || range > range_max_m) continue;
    const double angle = scan.first_angle_rad + beam * scan.step_rad;
    const mapping_3d::Position p = transformed(to_cloud, -range * std::sin(angle), range * std::cos(angle), 0);
    points.push_back({static_cast<float>(p.x_m), static_cast<float>(p.y_m), static_cast<float>(p.z_m)});
  }
}

}  // namespace takt::laser_cloud
