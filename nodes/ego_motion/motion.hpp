// SPDX-License-Identifier: Apache-2.0
// From matched corners to the motion between two frames (thesis Sec. 4.3.2, App. C, corrected).
// Frame: x right, y down, z forward. T maps previous camera coordinates into current ones: p_cur = T p_prev.
#pragma once
#include <cstdint>
#include <optional>
#include <span>

#include "nodes/ego_motion/rigid.hpp"

namespace takt::ego_motion {

/// One corner in both frames; x, y in px from the principal point, d = disparity in px.
struct Observation {
  double x = 0, y = 0, d = 0;
  double x_current = 0, y_current = 0;
  double d_current = -1;  ///< negative: not measured, the disparity row is left out
};

/// Focal length in px and baseline in m.
struct Optics {
  double focal_px = 0, baseline_m = 0;
};

/// The point in previous camera coordinates.
Eigen::Vector3d point(const Observation& observation, const Optics& optics);

/// Planar small-angle motion: rotation alpha about the y axis, translation in the x-z plane.
struct PlanarMotion {
  double alpha_rad = 0, tx_m = 0, tz_m = 0;
};

/// `multiplied`: each row of Eq. 4.13 times its denominator, residuals in px. `division`: the printed form, which gives
/// corners near the image axes huge weights; for comparison only.
enum class Form : uint8_t { multiplied, division };

/// Least squares over all observations with the linearised T of Sec. 4.3.2. Empty if fewer than two observations
/// or if they do not determine the motion.
std::optional<PlanarMotion> planar_least_squares(std::span<const Observation> observations, const Optics& optics,
                                                 Form form);

/// The rigid motion with that rotation (exact) and translation.
Rigid to_rigid(const PlanarMotion& motion);

constexpr double kNearestDepth = 0.05;                    ///< m; what a motion brings nearer is behind the camera
constexpr double kLeastDisparity = 0.1;                   ///< px; below it depth is noise
constexpr double kDisparityWeight = 0.70710678118654752;  ///< 1/sqrt(2): a difference of disparities has two noises

/// Residual of one observation under T in px: the length of (x, y, d) errors, the disparity error times
/// kDisparityWeight. Infinite behind the camera.
double residual_px(const Rigid& T, const Observation& o, const Optics& optics);

}  // namespace takt::ego_motion
