// SPDX-License-Identifier: Apache-2.0
#include "nodes/laser_fusion/generalised_icp.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "rt/msg/point.hpp"

namespace takt::laser_fusion {
namespace {

using Eigen::Matrix3d, Eigen::Vector3d;

Vector3d place(const Point& p) { return {p.x, p.y, p.z}; }

/// Of the surface around each point: 1 along it, `flatness` across.
std::vector<Matrix3d> surfaces_of(std::span<const Point> points, const GeneralisedIcpParameters& p) {
  std::vector<Matrix3d> surfaces;
  std::vector<Point> by_distance(points.begin(), points.end());
  const size_t count = std::min(p.neighbours, points.size());
  const auto farthest = by_distance.begin() + static_cast<std::ptrdiff_t>(count - 1);
  for (const Point& point : points) {
    std::nth_element(by_distance.begin(), farthest, by_distance.end(),
                     [&](const Point& a, const Point& b) { return distance2(a, point) < distance2(b, point); });
    Vector3d mean = Vector3d::Zero();
    Matrix3d scatter = Matrix3d::Zero();
    for (size_t i = 0; i < count; ++i) mean += place(by_distance[i]) / static_cast<double>(count);
    for (size_t i = 0; i < count; ++i) {
      const Vector3d off = place(by_distance[i]) - mean;
      scatter += off * off.transpose();
    }
    const Vector3d normal = Eigen::SelfAdjointEigenSolver<Matrix3d>(scatter).eigenvectors().col(0);
    surfaces.push_back(Matrix3d::Identity() - (1 - p.flatness) * normal * normal.transpose());
  }
  return surfaces;
}

}  // namespace

GeneralisedIcp::GeneralisedIcp(Matcher& matcher, const GeneralisedIcpParameters& parameters)
    : matcher_(&matcher),
      parameters_(parameters),
      fixed_(surfaces_of(matcher.fixed(), parameters)),
      moving_(surfaces_of(matcher.moving(), parameters)) {}

ego_motion::Twist GeneralisedIcp::step_from(const Rigid& pose) const {
  const double cut_m = matcher_->parameters().cut_m;
  const auto limit2 = static_cast<float>(cut_m * cut_m);
  ego_motion::Matrix6 information = ego_motion::Matrix6::Zero();
  ego_motion::Twist gradient = ego_motion::Twist::Zero();
  Eigen::Matrix<double, 3, 6> jacobian;
  jacobian.leftCols<3>().setIdentity();
  for (size_t i = 0; i < fixed_.size(); ++i) {
    const Nearest& near = matcher_->nearest()[i];
    if (!(near.distance2 <= limit2)) continue;
    const Vector3d moved = pose * place(matcher_->moving()[near.index]);
    const Matrix3d weight = (fixed_[i] + pose.R * moving_[near.index] * pose.R.transpose()).inverse();
    jacobian.rightCols<3>() = -ego_motion::skew(moved);
    information += jacobian.transpose() * weight * jacobian;
    gradient += jacobian.transpose() * weight * (place(matcher_->fixed()[i]) - moved);
  }
  return information.ldlt().solve(gradient);
}

Rigid GeneralisedIcp::run(const Rigid& start) {
  Rigid pose = start;
  for (int i = 0; i < parameters_.iterations; ++i) {
    if (matcher_->evaluate(pose).pairs < kLeastPairs) break;
    const ego_motion::Twist step = step_from(pose);
    pose = Rigid{ego_motion::rotation(step.tail<3>()), step.head<3>()} * pose;
    if (step.head<3>().norm() < parameters_.eps_m && step.tail<3>().norm() < parameters_.eps_rad) break;
  }
  return pose;
}

}  // namespace takt::laser_fusion
