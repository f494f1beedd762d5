// SPDX-License-Identifier: Apache-2.0
// The few operations on Transform that mapping needs.
#pragma once
#include <cstdint>
#include <span>

#include "rt/msg/messages.hpp"

namespace takt::mapping_3d {

/// 3 x 3 rotation, row-major, and translation: p_parent = r p_child + t.
struct Affine {
  double r[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  double t[3] = {};
};

Affine to_affine(const Transform& transform);
/// a * b: first b, then a.
Transform compose(const Transform& a, const Transform& b);
Transform inverse(const Transform& transform);
/// Between a (share 0) and b (share 1): straight line and constant turn rate the short way round.
Transform interpolate(const Transform& a, const Transform& b, double share);

/// A camera on the robot: position in the robot frame (x right, y forward, z up), pan about z (left positive), tilt
/// about x (up positive); camera axes x right, y down, z forward.
Transform camera_mount(double x_m, double y_m, double height_m, double pan_rad, double tilt_rad);

struct StampedPose {
  int64_t stamp_ns = 0;
  Transform pose;
};
/// Pose at `stamp_ns`, interpolated between its neighbours (oldest first); beyond the ends the nearest. Identity if
/// empty.
Transform pose_at(std::span<const StampedPose> poses, int64_t stamp_ns);

}  // namespace takt::mapping_3d
