// SPDX-License-Identifier: Apache-2.0
// Poses in the plane, and how they stand in the messages. A body's frame is the robot's: x right, y forward.
#pragma once
#include <Eigen/Core>
#include <cmath>
#include <numbers>

#include "rt/msg/geometry.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/transform/planar_pose.hpp"
#include "rt/transform/pose_math.hpp"

namespace takt::scan_matching {

/// Of the errors (x, y, theta) along the axes of the parent, as in rt/transform/pose_math.hpp.
using Covariance = Eigen::Matrix3d;

inline PlanarPose planar(const Transform& t) {
  return {t.x, t.y, std::atan2(2 * (t.qw * t.qz + t.qx * t.qy), 1 - 2 * (t.qy * t.qy + t.qz * t.qz))};
}

inline Transform to_transform(const PlanarPose& p) {
  return {p.x_m, p.y_m, 0, std::cos(p.theta_rad / 2), 0, 0, std::sin(p.theta_rad / 2)};
}

/// Without speeds. The robot drives along its y axis, whose direction an odometry gives (C-9).
inline Odometry to_odometry(const PlanarPose& p) { return {p.x_m, p.y_m, wrapped(p.theta_rad + std::numbers::pi / 2)}; }

/// Where x, y and theta stand in a covariance of six.
constexpr size_t kPlanarAxes[] = {0, 1, 5};

/// Height, roll and pitch are taken as known.
inline UncertainPose spatial(const PlanarPose& pose, const Covariance& covariance) {
  UncertainPose out{to_transform(pose), {}};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) out.covariance[6 * kPlanarAxes[i] + kPlanarAxes[j]] = covariance(i, j);
  return out;
}

inline Covariance planar(const PoseCovariance& covariance) {
  Covariance out;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) out(i, j) = covariance[6 * kPlanarAxes[i] + kPlanarAxes[j]];
  return out;
}

/// The covariance of a motion, given along the axes of a frame that is turned by `theta` against the one wanted.
inline Covariance turned(const Covariance& covariance, double theta_rad) {
  Covariance r = Covariance::Identity();
  r(0, 0) = r(1, 1) = std::cos(theta_rad);
  r(1, 0) = std::sin(theta_rad);
  r(0, 1) = -r(1, 0);
  return r * covariance * r.transpose();
}

}  // namespace takt::scan_matching
