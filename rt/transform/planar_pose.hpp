// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/transform/planar_pose.hpp>: core, experimental.
// Poses in the plane.
#pragma once
#include <cmath>
#include <numbers>

namespace takt {

/// p_parent = R(theta) p_child + (x, y).
struct PlanarPose {
  double x_m = 0, y_m = 0, theta_rad = 0;
};

/// Within half a turn to each side.
inline double wrapped(double angle_rad) { return std::remainder(angle_rad, 2 * std::numbers::pi); }

inline PlanarPose compose(const PlanarPose& parent, const PlanarPose& child) {
  const double c = std::cos(parent.theta_rad), s = std::sin(parent.theta_rad);
  return {parent.x_m + c * child.x_m - s * child.y_m, parent.y_m + s * child.x_m + c * child.y_m,
          wrapped(parent.theta_rad + child.theta_rad)};
}

/// `to` as it is seen from `from`: compose(from, between(from, to)) is `to`.
inline PlanarPose between(const PlanarPose& from, const PlanarPose& to) {
  const double c = std::cos(from.theta_rad), s = std::sin(from.theta_rad);
  const double dx = to.x_m - from.x_m, dy = to.y_m - from.y_m;
  return {c * dx + s * dy, c * dy - s * dx, wrapped(to.theta_rad - from.theta_rad)};
}

}  // namespace takt
