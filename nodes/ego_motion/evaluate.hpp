// SPDX-License-Identifier: Apache-2.0
// Quality of an estimated path against the true one.
#pragma once
#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "nodes/ego_motion/rigid.hpp"

namespace takt::ego_motion {

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
  std::vector<double> degrees, metres;
  for (size_t i = 1; i < n; ++i) {
    const Rigid moved = estimated[i - 1].inverse() * estimated[i];
    const Rigid true_moved = truth[i - 1].inverse() * truth[i];
    const Rigid error = true_moved.inverse() * moved;
    degrees.push_back(rotation_vector(error.R).norm() * 180 / 3.14159265358979323846);
    metres.push_back(error.t.norm());
    q.path_m += true_moved.t.norm();
  }
  const auto median = [](std::vector<double>& v) {
    std::sort(v.begin(), v.end());
    return v.size() % 2 ? v[v.size() / 2] : 0.5 * (v[v.size() / 2 - 1] + v[v.size() / 2]);
  };
  q.deg_per_frame = median(degrees);
  q.metres_per_frame = median(metres);
  const Rigid end = estimated[0].inverse() * estimated[n - 1], true_end = truth[0].inverse() * truth[n - 1];
  q.end_error_m = (end.t - true_end.t).norm();
  q.drift_pct = q.path_m > 0 ? 100 * q.end_error_m / q.path_m : 0;
  return q;
}

}  // namespace takt::ego_motion
