// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/msg/geometry.hpp>: core, stable.
// What several messages share: a rigid transform, a camera model. Units of all messages are SI unless a name says
// otherwise. Frames (thesis Fig. 4.11): robot frame x right, y forward, z up; camera frame x right, y down, z forward;
// map frame z up.
#pragma once
#include "rt/msg/field_list.hpp"

namespace takt {

/// Pinhole model of a rectified image; all zero while an image is not rectified.
struct CameraModel {
  double focal_px = 0, cu_px = 0, cv_px = 0;
  double baseline_m = 0;  ///< distance of the two optical centres of a rectified stereo pair
  TAKT_PARTS(CameraModel, (focal_px, "px"), (cu_px, "px"), (cv_px, "px"), (baseline_m, "m"))
};

/// Rigid transform as translation and unit quaternion: p_parent = R(q) p_child + t.
struct Transform {
  double x = 0, y = 0, z = 0;
  double qw = 1, qx = 0, qy = 0, qz = 0;
  TAKT_PARTS(Transform, (x, "m"), (y, "m"), (z, "m"), (qw, "1"), (qx, "1"), (qy, "1"), (qz, "1"))
};

}  // namespace takt
