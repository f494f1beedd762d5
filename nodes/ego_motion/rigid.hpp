// SPDX-License-Identifier: Apache-2.0
// Rigid motions as the ego-motion mathematics needs them: double precision, exact exponential and logarithm.
#pragma once
#include <Eigen/Dense>

#include "rt/msg/geometry.hpp"
#include "rt/state_archive.hpp"

namespace takt::ego_motion {

/// p_parent = R * p_child + t.
struct Rigid {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d t = Eigen::Vector3d::Zero();

  Rigid inverse() const { return {R.transpose(), -(R.transpose() * t)}; }
  Rigid operator*(const Rigid& child) const { return {R * child.R, R * child.t + t}; }
  Eigen::Vector3d operator*(const Eigen::Vector3d& p) const { return R * p + t; }
  void remember(StateArchive& archive) { TAKT_STATE(archive, R, t); }
};

using Twist = Eigen::Matrix<double, 6, 1>;  ///< translation (m), then rotation vector (rad)
using Matrix6 = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;

inline Eigen::Matrix3d skew(const Eigen::Vector3d& w) {
  Eigen::Matrix3d m;
  m << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0;
  return m;
}

/// Rotation of a rotation vector (axis times angle, rad).
inline Eigen::Matrix3d rotation(const Eigen::Vector3d& w) {
  const double angle = w.norm();
  if (angle < 1e-12) return Eigen::Matrix3d::Identity() + skew(w);
  return Eigen::AngleAxisd(angle, w / angle).toRotationMatrix();
}

/// Rotation vector of a rotation; its norm is the angle in 0..pi.
inline Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& R) {
  Eigen::Quaterniond q(R);
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  const double sine = q.vec().norm();
  if (sine < 1e-12) return 2.0 * q.vec();
  return q.vec() * (2.0 * std::atan2(sine, q.w()) / sine);
}

/// Motion over `share` of the time in which `motion` happened, at constant speed and turn rate.
inline Rigid scaled(const Rigid& motion, double share) {
  return {rotation(rotation_vector(motion.R) * share), motion.t * share};
}

inline Transform to_transform(const Rigid& motion) {
  Eigen::Quaterniond q(motion.R);
  q.normalize();
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  return {motion.t.x(), motion.t.y(), motion.t.z(), q.w(), q.x(), q.y(), q.z()};
}

inline Rigid from_transform(const Transform& t) {
  return {Eigen::Quaterniond(t.qw, t.qx, t.qy, t.qz).normalized().toRotationMatrix(), {t.x, t.y, t.z}};
}

}  // namespace takt::ego_motion
