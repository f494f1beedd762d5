// SPDX-License-Identifier: Apache-2.0
// Where a camera sits on the robot, and poses as matrices for loops over points.
#pragma once
#include "rt/msg/geometry.hpp"

namespace takt {
struct Odometry;
}

namespace takt::mapping_3d {

/// 3 x 3 rotation, row-major, and translation: p_parent = r p_child + t.
struct Affine {
  double r[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  double t[3] = {};
};

Affine to_affine(const Transform& transform);

/// A place in some frame.
struct Position {
  double x_m = 0, y_m = 0, z_m = 0;
};

/// A place in the child frame, seen from the parent frame.
inline Position transformed(const Affine& a, double x, double y, double z) {
  return {a.r[0] * x + a.r[1] * y + a.r[2] * z + a.t[0], a.r[3] * x + a.r[4] * y + a.r[5] * z + a.t[1],
          a.r[6] * x + a.r[7] * y + a.r[8] * z + a.t[2]};
}

/// A camera on the robot: position in the robot frame (x right, y forward, z up), pan about z (left positive), tilt
/// about x (up positive); camera axes x right, y down, z forward.
Transform camera_mount(double x_m, double y_m, double height_m, double pan_rad, double tilt_rad);

/// Where a sensor is mounted; the identity says that nobody knows.
inline bool is_known(const Transform& t) {
  return t.x != 0 || t.y != 0 || t.z != 0 || t.qx != 0 || t.qy != 0 || t.qz != 0;
}

/// A camera on the head, whose pivot is its optical centre: the pose at rest with the head's pan (about z, left
/// positive) and tilt (up positive) added to its own.
Transform turned_by_head(const Transform& at_rest, double pan_rad, double tilt_rad);

/// The robot frame in the odometry frame: theta is the driving direction, which is the robot's y axis, so that its x
/// axis points to theta - 90 degrees (C-9).
Transform robot_in_odometry(const Odometry& odometry);

}  // namespace takt::mapping_3d
