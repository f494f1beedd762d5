// SPDX-License-Identifier: Apache-2.0
// From matched corners to the motion between two frames (thesis Sec. 4.3.2, App. C, corrected).
// Frame: x right, y down, z forward. T maps previous camera coordinates into current ones: p_cur = T p_prev.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

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

/// Residual of one observation under T in px: the length of (x, y, d) errors, the disparity error weighted 1/sqrt(2)
/// because it holds the noise of two disparities. Infinite behind the camera.
double residual_px(const Rigid& T, const Observation& o, const Optics& optics);

enum class Model : uint8_t { six_dof, planar };

struct EstimatorParameters {
  Model model = Model::six_dof;
  Form form = Form::multiplied;
  bool robust = true;      ///< false: all observations count alike (thesis)
  double inlier_px = 1.0;  ///< largest residual of an inlier
  int iterations = 200;    ///< most random samples
  double success = 0.999;  ///< stop sampling once the best sample was drawn with that probability
};

struct Estimate {
  Rigid T;  ///< previous camera coordinates -> current
  int inliers = 0;
  double rms_px = 0;  ///< of the inliers
  bool solved = false;
};

/// Robust motion of up to `capacity` observations. No allocation after construction; the result depends on the
/// arguments alone (own random numbers from `seed`).
class MotionEstimator {
 public:
  MotionEstimator() = default;
  MotionEstimator(const EstimatorParameters& parameters, size_t capacity) : p_(parameters) {
    inliers_.reserve(capacity);
  }
  /// `start` is a guess of T, e.g. the motion before.
  Estimate estimate(std::span<const Observation> observations, const Optics& optics, const Rigid& start, uint64_t seed);

 private:
  bool solve(std::span<const Observation> observations, const Optics& optics, bool weighted, int iterations,
             Rigid& T) const;
  Rigid sample_consensus(std::span<const Observation> observations, const Optics& optics, const Rigid& start,
                         uint64_t seed);
  void collect(std::span<const Observation> observations, const Optics& optics, const Rigid& T, double limit_px);

  EstimatorParameters p_;
  std::vector<Observation> inliers_;
};

}  // namespace takt::ego_motion
