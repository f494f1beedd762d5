// SPDX-License-Identifier: Apache-2.0
#include "nodes/mapping_3d/pose.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "rt/msg/odometry.hpp"

namespace takt::mapping_3d {

Affine to_affine(const Transform& t) {
  const Eigen::Matrix3d r = Eigen::Quaterniond(t.qw, t.qx, t.qy, t.qz).normalized().toRotationMatrix();
  Affine affine{{}, {t.x, t.y, t.z}};
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) affine.r[3 * row + column] = r(row, column);
  return affine;
}

Transform camera_mount(double x_m, double y_m, double height_m, double pan_rad, double tilt_rad) {
  using Eigen::AngleAxisd, Eigen::Vector3d;
  // Camera y (down) to robot -z, camera z (forward) to robot y: -90 deg about x.
  const Eigen::Quaterniond q =
      AngleAxisd(pan_rad, Vector3d::UnitZ()) * AngleAxisd(tilt_rad - std::numbers::pi / 2, Vector3d::UnitX());
  return {x_m, y_m, height_m, q.w(), q.x(), q.y(), q.z()};
}

// At rest R = Rz(pan0) Rx(tilt0) Ry(roll0) and then the axes of a camera, whose forward axis Ry leaves in place: pan0
// is read off it, and the head's tilt goes between Rz and Rx.
Transform turned_by_head(const Transform& at_rest, double pan_rad, double tilt_rad) {
  using Eigen::AngleAxisd, Eigen::Vector3d;
  const Eigen::Quaterniond q(at_rest.qw, at_rest.qx, at_rest.qy, at_rest.qz);
  const Vector3d ahead = q * Vector3d::UnitZ();
  const double pan0_rad = std::atan2(-ahead.x(), ahead.y());
  const Eigen::Quaterniond turned = AngleAxisd(pan0_rad + pan_rad, Vector3d::UnitZ()) *
                                    AngleAxisd(tilt_rad, Vector3d::UnitX()) * AngleAxisd(-pan0_rad, Vector3d::UnitZ()) *
                                    q;
  return {at_rest.x, at_rest.y, at_rest.z, turned.w(), turned.x(), turned.y(), turned.z()};
}

Transform robot_in_odometry(const Odometry& odometry) {
  const double half = (odometry.theta_rad - std::numbers::pi / 2) / 2;
  return {odometry.x_m, odometry.y_m, 0, std::cos(half), 0, 0, std::sin(half)};
}

}  // namespace takt::mapping_3d
