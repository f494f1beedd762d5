// SPDX-License-Identifier: Apache-2.0
// The motion that most observations agree on: sample consensus, then Gauss-Newton with Cauchy weights.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "nodes/ego_motion/motion.hpp"
#include "nodes/ego_motion/motion_kernel.hpp"
#include "rt/transform/pose_math.hpp"

namespace takt::ego_motion {

enum class Model : uint8_t { six_dof, planar };

struct EstimatorParameters {
  Model model = Model::six_dof;
  Form form = Form::multiplied;
  bool robust = true;      ///< false: all observations count alike (thesis)
  double inlier_px = 1.0;  ///< largest residual of an inlier
  int iterations = 200;    ///< most random samples
  double success = 0.999;  ///< stop sampling once the best sample was drawn with that probability
  /// Standard deviation of an error that all corners of a frame share, in x, y and d each: interpolation at equal
  /// fractions of a pixel, rectification. Enters the covariance only.
  double shared_px = 0.05;
};

struct Estimate {
  Rigid T;  ///< previous camera coordinates -> current
  /// Of the error of T as a small motion after it, translation (m) and rotation (rad) along the axes of the current
  /// camera: T_true = Exp(error) T. What a planar model leaves out has variance 0.
  Matrix6 covariance = Matrix6::Zero();
  int inliers = 0;
  double rms_px = 0;  ///< of the inliers
  bool solved = false;
};

/// T^-1 as a pose with its covariance (rt/transform/pose_math.hpp).
UncertainPose camera_in_previous(const Estimate& estimate);

/// Robust motion of up to `capacity` observations. No allocation after construction; the result depends on the
/// arguments alone (own random numbers from `seed`).
class MotionEstimator {
 public:
  MotionEstimator() = default;
  MotionEstimator(const EstimatorParameters& parameters, size_t capacity);
  /// From the next estimate() on.
  void tune(const EstimatorParameters& parameters) { p_ = parameters; }
  /// `start` is a guess of T, e.g. the motion before.
  Estimate estimate(std::span<const Observation> observations, const Optics& optics, const Rigid& start, uint64_t seed);

 private:
  bool solve(const ObservationTable& table, const double* use, bool weighted, int iterations, Rigid& T) const;
  Rigid sample_consensus(std::span<const Observation> observations, const Rigid& start, uint64_t seed);
  std::optional<Matrix6> covariance(const Rigid& T, bool weighted) const;
  double scale_px() const { return 0.5 * p_.inlier_px; }  ///< a residual of this size counts half

  EstimatorParameters p_;
  ObservationTable all_, sample_;
  std::vector<double> use_;  ///< 1: the observation enters the normal equations
};

}  // namespace takt::ego_motion
