// SPDX-License-Identifier: Apache-2.0
// People that the project makes itself, with ground truth, for measurements: joint angles are continuous and not those
// of the typical poses, lengths differ by 15 %; one camera sees them among furniture with the noise of stereo.
#pragma once
#include <cstdint>
#include <vector>

#include "nodes/body_pose/skeleton.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/point.hpp"

namespace takt::body_pose {

/// What sees the scene: by default the wide camera of the robot, X2, looking ahead.
struct SceneCamera {
  int width = 640, height = 480, step_px = 2;  ///< one point per step x step pixels
  double focal_px = 283.1, baseline_m = 0.12;
  double height_m = 1.2, tilt_rad = -0.1;
  double noise_px = 0.1;                ///< standard deviation of a disparity
  double disparity_step_px = 1.0 / 64;  ///< 1: as of stereo without `subpixel`
  double missing = 0.05;                ///< share of pixels without a disparity
  double smeared = 0.3;                 ///< share of pixels at a depth edge that get a depth between both
};

/// A body of known pose.
struct TrueBody {
  std::vector<Eigen::Vector3d> joints;  ///< floor frame, by link
  size_t pointer = 0;                   ///< which of the skeleton's pointers it points with
  Eigen::Vector3d pointing() const;     ///< unit
  size_t from = 0, to = 0;              ///< joints of the pointer
};

struct GeneratedScene {
  TrueBody body;
  CameraModel camera;
  Transform camera_in_floor;
  std::vector<Point> points;    ///< camera frame
  std::vector<Point> in_floor;  ///< the same, floor frame
  std::vector<uint8_t> image;   ///< BGR, one pixel for each ray
  int width = 0, height = 0;    ///< of `image`
};

/// A person pointing with one arm (drawn by lot), who faces the camera to 75 degrees; the other arm hangs, is bent or
/// points, too. The skeleton is human.txt or has its links. Equal arguments give equal scenes.
GeneratedScene make_person(const Skeleton& skeleton, const SceneCamera& camera, uint64_t seed, uint64_t index,
                           bool clutter = true);
/// Any skeleton in one of its typical poses, each link turned within its degrees of freedom by up to 15 degrees,
/// without furniture.
GeneratedScene make_any(const Skeleton& skeleton, const SceneCamera& camera, uint64_t seed, uint64_t index);

}  // namespace takt::body_pose
