// SPDX-License-Identifier: Apache-2.0
#include "nodes/person_tracking/person_filter.hpp"

#include <Eigen/Dense>

namespace takt::person_tracking {

using Eigen::Matrix2d, Eigen::Matrix4d, Eigen::MatrixXd, Eigen::Vector4d, Eigen::VectorXd;

Matrix4d transition(double dt_s) {
  Matrix4d f = Matrix4d::Identity();
  f.topRightCorner<2, 2>() = dt_s * Matrix2d::Identity();
  return f;
}

Matrix4d process_noise(const FilterParameters& p, double dt_s) {
  const Matrix2d one = p.acceleration * Matrix2d::Identity();
  Matrix4d q;
  q << dt_s * dt_s * dt_s / 3 * one, dt_s * dt_s / 2 * one, dt_s * dt_s / 2 * one, dt_s * one;
  return q;
}

void PersonFilter::begin(const Place& first) {
  now_.state << first.at, 0, 0;
  now_.covariance.setZero();
  now_.covariance.topLeftCorner<2, 2>() = first.covariance;
  now_.covariance.bottomRightCorner<2, 2>() = p_.speed_sigma * p_.speed_sigma * Matrix2d::Identity();
}

Estimate PersonFilter::after(double dt_s) const {
  const Matrix4d f = transition(dt_s);
  return {f * now_.state, f * now_.covariance * f.transpose() + process_noise(p_, dt_s)};
}

void PersonFilter::predict(double dt_s) { now_ = after(dt_s); }

double PersonFilter::distance2(const Place& seen) const {
  const Matrix2d s = now_.covariance.topLeftCorner<2, 2>() + seen.covariance;
  const Eigen::Vector2d off = seen.at - now_.position();
  return off.dot(s.inverse() * off);
}

/// In Joseph's form, which keeps the covariance symmetric and positive.
void PersonFilter::update(const Place& seen) {
  const Matrix2d s = now_.covariance.topLeftCorner<2, 2>() + seen.covariance;
  const Eigen::Matrix<double, 4, 2> gain = now_.covariance.leftCols<2>() * s.inverse();
  now_.state += gain * (seen.at - now_.position());
  Matrix4d keep = Matrix4d::Identity();
  keep.leftCols<2>() -= gain;
  now_.covariance = keep * now_.covariance * keep.transpose() + gain * seen.covariance * gain.transpose();
}

Estimate filter_reference(const FilterParameters& p, std::span<const TimedPlace> seen) {
  const auto states = static_cast<Eigen::Index>(seen.size());
  MatrixXd information = MatrixXd::Zero(4 * states, 4 * states);
  VectorXd right = VectorXd::Zero(4 * states);
  information.block<2, 2>(2, 2).diagonal().setConstant(1 / (p.speed_sigma * p.speed_sigma));
  for (Eigen::Index i = 0; i < states; ++i) {
    const TimedPlace& now = seen[static_cast<size_t>(i)];
    const Matrix2d weight = now.place.covariance.inverse();
    information.block<2, 2>(4 * i, 4 * i) += weight;
    right.segment<2>(4 * i) += weight * now.place.at;
    if (i == 0) continue;
    Eigen::Matrix<double, 4, 8> follows;
    follows << -transition(now.dt_s), Matrix4d::Identity();
    information.block<8, 8>(4 * i - 4, 4 * i - 4) +=
        follows.transpose() * process_noise(p, now.dt_s).inverse() * follows;
  }
  const Eigen::LDLT<MatrixXd> solver(information);
  const VectorXd all = solver.solve(right);
  const MatrixXd covariance = solver.solve(MatrixXd::Identity(4 * states, 4 * states));
  return {all.tail<4>(), covariance.bottomRightCorner<4, 4>()};
}

}  // namespace takt::person_tracking
