// SPDX-License-Identifier: Apache-2.0
// Quality of estimated motions and of an estimated path against the true ones. Allocates; for evaluation only.
#pragma once
#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <vector>

#include "nodes/ego_motion/rigid.hpp"
#include "rt/quantile.hpp"
#include "rt/transform/pose_math.hpp"

namespace takt::ego_motion {

inline double degrees(const Eigen::Matrix3d& R) { return rotation_vector(R).norm() * 180 / std::numbers::pi; }

/// How far a motion is from the true one.
struct StepError {
  double metres = 0, degrees = 0;
};
inline StepError step_error(const Rigid& motion, const Rigid& truth) {
  return {(motion.t - truth.t).norm(), degrees(truth.R.transpose() * motion.R)};
}

/// Normalised error squared e^T C^-1 e of a pose with its stated covariance C (error as in rt/transform/pose_math.hpp):
/// of a consistent one distributed as chi^2 with 6 degrees of freedom (Bar-Shalom, Li, Kirubarajan, "Estimation with
/// Applications to Tracking and Navigation", 2001, 5.4).
inline double normalised_error_squared(const UncertainPose& pose, const Rigid& truth) {
  const Rigid estimated = from_transform(pose.transform);
  Twist error;
  error << truth.t - estimated.t, rotation_vector(truth.R * estimated.R.transpose());
  const Matrix6 covariance = Eigen::Map<const Matrix6>(pose.covariance.data());
  return error.dot(covariance.ldlt().solve(error));
}

struct Quality {
  double drift_pct = 0;         ///< distance of the two end points / length of the true path
  double deg_per_frame = 0;     ///< median error of the rotation between consecutive frames
  double metres_per_frame = 0;  ///< median error of the translation between consecutive frames
  double path_m = 0, end_error_m = 0;
};

/// Compares poses (camera in any fixed frame; both lists are taken relative to their first pose). Allocates; for
/// evaluation only. All zero for fewer than two poses; a surplus of either list is ignored.
inline Quality evaluate(std::span<const Rigid> estimated, std::span<const Rigid> truth) {
  Quality q;
  const size_t n = std::min(estimated.size(), truth.size());
  if (n < 2) return q;
  std::vector<double> turns, shifts;
  for (size_t i = 1; i < n; ++i) {
    const Rigid moved = estimated[i - 1].inverse() * estimated[i];
    const Rigid true_moved = truth[i - 1].inverse() * truth[i];
    const Rigid error = true_moved.inverse() * moved;
    turns.push_back(degrees(error.R));
    shifts.push_back(error.t.norm());
    q.path_m += true_moved.t.norm();
  }
  const auto median = [](std::vector<double>& v) {
    std::sort(v.begin(), v.end());
    return v.size() % 2 ? v[v.size() / 2] : 0.5 * (v[v.size() / 2 - 1] + v[v.size() / 2]);
  };
  q.deg_per_frame = median(turns);
  q.metres_per_frame = median(shifts);
  const Rigid end = estimated[0].inverse() * estimated[n - 1], true_end = truth[0].inverse() * truth[n - 1];
  q.end_error_m = (end.t - true_end.t).norm();
  q.drift_pct = q.path_m > 0 ? 100 * q.end_error_m / q.path_m : 0;
  return q;
}

}  // namespace takt::ego_motion
