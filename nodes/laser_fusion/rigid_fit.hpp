// SPDX-License-Identifier: Apache-2.0
// The rigid motion that brings paired points together (thesis Eq. 4.14 - 4.16), by the unit-quaternion method of Horn,
// 1987 and Besl and McKay, 1992.
#pragma once
#include <cstddef>

#include "nodes/laser_fusion/pose_parameters.hpp"

namespace takt::laser_fusion {

/// Fewer pairs than this determine no pose one could trust (C-4).
constexpr size_t kLeastPairs = 6;

/// What the fit needs to know of pairs (p1, p2), p1 = R p2 + t but for noise.
struct PairSums {
  size_t pairs = 0;
  Eigen::Vector3d p1 = Eigen::Vector3d::Zero(), p2 = Eigen::Vector3d::Zero();
  Eigen::Matrix3d p2_p1 = Eigen::Matrix3d::Zero();  ///< of p2 p1^T

  void add(const Eigen::Vector3d& fixed, const Eigen::Vector3d& moving) {
    ++pairs;
    p1 += fixed;
    p2 += moving;
    p2_p1 += moving * fixed.transpose();
  }
};

/// argmin over (R, t) of the sum of ||p1 - (R p2 + t)||^2. At least one pair.
Rigid fit_rigid(const PairSums& sums);

/// The same with parameters held at those of `current`: the rotation of the free fit with its locked angles put back,
/// the best translation to that rotation, and of it the locked coordinates put back.
PoseParameters fit_rigid(const PairSums& sums, const PoseParameters& current, const Locks& locks);

}  // namespace takt::laser_fusion
