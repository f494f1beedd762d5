// SPDX-License-Identifier: Apache-2.0
#include "rt/transform/pose_math.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

namespace takt {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;

Eigen::Vector3d translation(const Transform& t) { return {t.x, t.y, t.z}; }
Eigen::Quaterniond rotation(const Transform& t) { return {t.qw, t.qx, t.qy, t.qz}; }

Transform transform(const Eigen::Vector3d& t, const Eigen::Quaterniond& q) {
  return {t.x(), t.y(), t.z(), q.w(), q.x(), q.y(), q.z()};
}

Eigen::Matrix3d cross(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

Eigen::Map<const Matrix6> matrix(const PoseCovariance& c) { return Eigen::Map<const Matrix6>(c.data()); }

/// The two triangles of a covariance must stay equal to the last bit, whatever the order of the sums was.
void store(const Matrix6& covariance, PoseCovariance& out) {
  Eigen::Map<Matrix6>(out.data()) = 0.5 * (covariance + covariance.transpose());
}

}  // namespace

UncertainPose compose(const UncertainPose& b_in_a, const UncertainPose& c_in_b) {
  const Eigen::Quaterniond q_ab = rotation(b_in_a.transform);
  const Eigen::Vector3d arm = q_ab * translation(c_in_b.transform);  // from b to c, along the axes of a
  UncertainPose c_in_a;
  c_in_a.transform = transform(translation(b_in_a.transform) + arm, (q_ab * rotation(c_in_b.transform)).normalized());

  // dt = dt_ab - [arm]x dr_ab + R_ab dt_bc,  dr = dr_ab + R_ab dr_bc
  Matrix6 by_first = Matrix6::Identity();
  by_first.topRightCorner<3, 3>() = -cross(arm);
  Matrix6 by_second = Matrix6::Zero();
  const Eigen::Matrix3d r_ab = q_ab.toRotationMatrix();
  by_second.topLeftCorner<3, 3>() = r_ab;
  by_second.bottomRightCorner<3, 3>() = r_ab;
  const Matrix6 sum = by_first * matrix(b_in_a.covariance) * by_first.transpose() +
                      by_second * matrix(c_in_b.covariance) * by_second.transpose();
  store(sum, c_in_a.covariance);
  return c_in_a;
}

UncertainPose inverse(const UncertainPose& child_in_parent) {
  const Eigen::Quaterniond back = rotation(child_in_parent.transform).conjugate();
  const Eigen::Vector3d t = translation(child_in_parent.transform);
  UncertainPose parent_in_child;
  parent_in_child.transform = transform(-(back * t), back);

  // dt' = -R^T dt - R^T [t]x dr,  dr' = -R^T dr
  const Eigen::Matrix3d r_back = back.toRotationMatrix();
  Matrix6 jacobian = Matrix6::Zero();
  jacobian.topLeftCorner<3, 3>() = -r_back;
  jacobian.topRightCorner<3, 3>() = -r_back * cross(t);
  jacobian.bottomRightCorner<3, 3>() = -r_back;
  const Matrix6 propagated = jacobian * matrix(child_in_parent.covariance) * jacobian.transpose();
  store(propagated, parent_in_child.covariance);
  return parent_in_child;
}

UncertainPose interpolate(const UncertainPose& from, const UncertainPose& to, double fraction) {
  UncertainPose between;
  const Eigen::Vector3d t = (1 - fraction) * translation(from.transform) + fraction * translation(to.transform);
  between.transform = transform(t, rotation(from.transform).slerp(fraction, rotation(to.transform)).normalized());
  const Matrix6 covariance = (1 - fraction) * matrix(from.covariance) + fraction * matrix(to.covariance);
  store(covariance, between.covariance);
  return between;
}

bool is_valid(const UncertainPose& pose) {
  const Transform& t = pose.transform;
  for (double value : {t.x, t.y, t.z, t.qw, t.qx, t.qy, t.qz})
    if (!std::isfinite(value)) return false;
  for (double value : pose.covariance)
    if (!std::isfinite(value)) return false;
  return rotation(t).squaredNorm() > 1e-12;
}

UncertainPose normalised(const UncertainPose& pose) {
  UncertainPose unit = pose;
  unit.transform = transform(translation(pose.transform), rotation(pose.transform).normalized());
  return unit;
}

}  // namespace takt
