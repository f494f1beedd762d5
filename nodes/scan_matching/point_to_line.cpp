// SPDX-License-Identifier: Apache-2.0
#include "nodes/scan_matching/point_to_line.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace takt::scan_matching {
namespace {

// Steps squared, in standard deviations of the pose: it moves no more; or it hops to and fro between two sets of pairs,
// by less than it is known.
constexpr double kStill = 1e-8, kNearly = 0.25;

/// Sums over the pairs at one pose.
struct Sums {
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();  ///< sum w J J^T
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();     ///< sum w J r
  double weights = 0, squares = 0;                        ///< sum w, sum w r^2
  int paired = 0;
};

Sums sum_up(const LocalMap& map, std::span<const SurfacePoint> points, const PlanarPose& pose, double scale_m,
            NearestPoint nearest) {
  Sums sums;
  for (const SurfacePoint& point : points) {
    if (!point.has_normal()) continue;
    const SurfacePoint p = transformed(pose, point);
    const SurfacePoint* m = (map.*nearest)(p);
    if (m == nullptr) continue;
    const double r = m->nx * (p.x_m - m->x_m) + m->ny * (p.y_m - m->y_m);
    const double w = 1 / (1 + r * r / (scale_m * scale_m));
    // A turn moves the point across its arm from the robot.
    const Eigen::Vector3d jacobian(m->nx, m->ny, m->ny * (p.x_m - pose.x_m) - m->nx * (p.y_m - pose.y_m));
    sums.information += w * jacobian * jacobian.transpose();
    sums.gradient += w * r * jacobian;
    sums.weights += w;
    sums.squares += w * r * r;
    ++sums.paired;
  }
  return sums;
}

/// Largest eigenvalue of prior relative to prior + measured.
double share_of(const Eigen::Matrix3d& prior, const Eigen::Matrix3d& all) {
  const Eigen::LLT<Eigen::Matrix3d> root(all);
  const Eigen::Matrix3d half = root.matrixL().solve(prior);
  const Eigen::Matrix3d relative = root.matrixL().solve(half.transpose());
  return std::clamp(Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(relative, Eigen::EigenvaluesOnly).eigenvalues()(2),
                    0.0, 1.0);
}

}  // namespace

Refined refine(const LocalMap& map, std::span<const SurfacePoint> points, const Expected& expected,
               const PlanarPose& start, const RefineParameters& p, NearestPoint nearest) {
  const Eigen::Vector3d weight(1 / (expected.sigma_m * expected.sigma_m), 1 / (expected.sigma_m * expected.sigma_m),
                               1 / (expected.sigma_rad * expected.sigma_rad));
  const Eigen::Matrix3d prior = weight.asDiagonal();
  Refined out;
  out.robot_in_map = start;
  for (int i = 0; i < p.iterations; ++i) {
    PlanarPose& pose = out.robot_in_map;
    const Sums sums = sum_up(map, points, pose, p.scale_m, nearest);
    out.paired = sums.paired;
    out.rms_m = sums.weights > 0 ? std::sqrt(sums.squares / sums.weights) : 0;
    const double noise_m = std::max(p.noise_m, out.rms_m), facts = 1 / (p.beams_per_fact * noise_m * noise_m);
    const Eigen::Matrix3d all = facts * sums.information + prior;
    const Eigen::Vector3d off(pose.x_m - expected.robot_in_map.x_m, pose.y_m - expected.robot_in_map.y_m,
                              wrapped(pose.theta_rad - expected.robot_in_map.theta_rad));
    const Eigen::Vector3d step = all.llt().solve(-(facts * sums.gradient + prior * off));
    pose = {pose.x_m + step.x(), pose.y_m + step.y(), wrapped(pose.theta_rad + step.z())};
    const double moved = step.dot(all * step);
    out.converged = moved < kNearly;
    if (moved > kStill && i + 1 < p.iterations) continue;
    out.covariance = all.llt().solve(Eigen::Matrix3d::Identity());
    out.prior_share = share_of(prior, all);
    break;
  }
  return out;
}

}  // namespace takt::scan_matching
