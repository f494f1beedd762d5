// SPDX-License-Identifier: Apache-2.0
// The returns of one sweep as points of the plane, each with the direction of the surface that it lies on.
#pragma once
#include <span>
#include <vector>

#include "nodes/scan_matching/planar.hpp"

namespace takt::scan_matching {

/// One sweep as the scanner gives it: angles counter-clockwise from its forward axis y, ranges 0 where nothing came
/// back. The scanner is level.
struct Sweep {
  double first_angle_rad = 0, step_rad = 0;
  std::span<const float> range_m;
  PlanarPose sensor_in_robot;
};

/// A place and the unit normal of its surface, towards the scanner; 0 0: none is known.
struct SurfacePoint {
  double x_m = 0, y_m = 0;
  double nx = 0, ny = 0;
  bool has_normal() const { return nx != 0 || ny != 0; }
};

/// Returns of at most range_max_m, robot frame, in the order of the beams; within the capacity of `points`, which the
/// caller reserved for as many as there are beams. The normal is that of the line that fits a return and its neighbours
/// best (total least squares): those within 0.2 m to each side, at least three and at most twenty, as far as the
/// surface does not break off. There is none if fewer than four lie on it or they do not lie on a line (5 cm rms, or a
/// fifth of their extent).
void points_of(const Sweep& sweep, double range_max_m, std::vector<SurfacePoint>& points);

/// The point as it is seen from the parent of `pose`.
inline SurfacePoint transformed(const PlanarPose& pose, const SurfacePoint& p) {
  const double c = std::cos(pose.theta_rad), s = std::sin(pose.theta_rad);
  return {pose.x_m + c * p.x_m - s * p.y_m, pose.y_m + s * p.x_m + c * p.y_m, c * p.nx - s * p.ny, s * p.nx + c * p.ny};
}

}  // namespace takt::scan_matching
