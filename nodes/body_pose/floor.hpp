// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <optional>
#include <span>

#include "nodes/mapping_3d/pose.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/point.hpp"

namespace takt::body_pose {

struct FloorParameters {
  double tilt_max_rad = 0.7;                      ///< of the camera, from level
  double height_min_m = 0.4, height_max_m = 2.5;  ///< of the camera above the floor
  double near_m = 0.03;                           ///< points so near the plane lie in it
  double share_min = 0.05;                        ///< of the points that must lie in it
  double below_max = 0.02;                        ///< share that may lie below it
};

/// Where a camera is above the floor that it sees: the plane with most points, by random triples of them (RANSAC, a
/// fixed seed), then least squares. Points in the camera frame (x right, y down, z forward); the floor frame has its
/// origin below the camera, y ahead, z up. Nothing if no plane will do. Allocates nothing.
std::optional<Transform> find_floor(std::span<const Point> points, const FloorParameters& parameters);

}  // namespace takt::body_pose
