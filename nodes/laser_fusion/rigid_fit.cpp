// SPDX-License-Identifier: Apache-2.0
#include "nodes/laser_fusion/rigid_fit.hpp"

#include <Eigen/Eigenvalues>

namespace takt::laser_fusion {
namespace {

Eigen::Matrix3d best_rotation(const PairSums& sums) {
  const auto n = static_cast<double>(sums.pairs);
  const Eigen::Matrix3d s = sums.p2_p1 / n - (sums.p2 / n) * (sums.p1 / n).transpose();  // cross covariance
  const Eigen::Matrix3d a = s - s.transpose();
  const Eigen::Vector3d delta(a(1, 2), a(2, 0), a(0, 1));
  Eigen::Matrix4d q;
  q(0, 0) = s.trace();
  q.topRightCorner<1, 3>() = delta.transpose();
  q.bottomLeftCorner<3, 1>() = delta;
  q.bottomRightCorner<3, 3>() = s + s.transpose() - s.trace() * Eigen::Matrix3d::Identity();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> solver(q);
  const Eigen::Vector4d v = solver.eigenvectors().col(3);  // of the largest eigenvalue
  return Eigen::Quaterniond(v(0), v(1), v(2), v(3)).normalized().toRotationMatrix();
}

Eigen::Vector3d best_translation(const PairSums& sums, const Eigen::Matrix3d& rotation) {
  return (sums.p1 - rotation * sums.p2) / static_cast<double>(sums.pairs);
}

}  // namespace

Rigid fit_rigid(const PairSums& sums) {
  const Eigen::Matrix3d rotation = best_rotation(sums);
  return {rotation, best_translation(sums, rotation)};
}

PoseParameters fit_rigid(const PairSums& sums, const PoseParameters& current, const Locks& locks) {
  PoseParameters next = to_parameters({best_rotation(sums), Eigen::Vector3d::Zero()});
  for (const Parameter angle : {kYaw, kPitch, kRoll})
    if (locks[angle]) next[angle] = current[angle];
  const Eigen::Vector3d t = best_translation(sums, to_rigid(next).R);
  for (const Parameter axis : {kX, kY, kZ}) next[axis] = locks[axis] ? current[axis] : t[axis];
  return next;
}

}  // namespace takt::laser_fusion
