// SPDX-License-Identifier: Apache-2.0
// A drive whose accelerations are the filter's white noise, and what three sensors measure of it, each at its own rate,
// with its own noise and delay.
#pragma once
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "nodes/robot_pose/pose_filter.hpp"

namespace takt::test {

using robot_pose::Covariance;
using robot_pose::Measured;
using robot_pose::Source;

struct Arrival {
  int64_t arrives_ns = 0;
  Measured measured;
};

struct GeneratedDrive {
  static constexpr int64_t kStep_ns = 1'000'000;
  std::vector<PlanarPose> truth;  ///< each millisecond
  std::vector<Arrival> arrivals;  ///< in the order of their coming

  const PlanarPose& at(int64_t stamp_ns) const { return truth[static_cast<size_t>(stamp_ns / kStep_ns)]; }

  GeneratedDrive(uint64_t seed, double duration_s, const robot_pose::FilterParameters& p) {
    std::mt19937_64 random(seed);
    std::normal_distribution<> noise(0, 1);
    const double dt = 1e-3, root = std::sqrt(dt);
    double v = p.begin_speed_m_s * noise(random), w = p.begin_turn_rad_s * noise(random);
    PlanarPose robot;
    const auto steps = static_cast<int64_t>(duration_s / dt);
    for (int64_t i = 0; i <= steps; ++i) {
      truth.push_back(robot);
      robot = compose(robot, {p.slip * root * noise(random), v * dt, w * dt});
      v += p.acceleration * root * noise(random);
      w += p.turn_acceleration * root * noise(random);
    }
    add(random, Source::wheels, 1.0 / 15, 0.005, {0.01, 0.01, 0.01});
    add(random, Source::ego_motion, 0.1, 0.08, {0.004, 0.006, 0.003});
    add(random, Source::scans, 0.2, 0.15, {0.005, 0.005, 0.002});
    std::stable_sort(arrivals.begin(), arrivals.end(),
                     [](const Arrival& a, const Arrival& b) { return a.arrives_ns < b.arrives_ns; });
  }

 private:
  void add(std::mt19937_64& random, Source source, double period_s, double delay_s, const Eigen::Vector3d& sigma) {
    std::normal_distribution<> noise(0, 1);
    const auto period = static_cast<int64_t>(period_s * 1e3) * kStep_ns;
    const auto last = static_cast<int64_t>(truth.size() - 1) * kStep_ns;
    for (int64_t to = period; to <= last; to += period) {
      PlanarPose moved = between(at(to - period), at(to));
      moved.x_m += sigma.x() * noise(random);
      moved.y_m += sigma.y() * noise(random);
      moved.theta_rad += sigma.z() * noise(random);
      const Covariance covariance = sigma.cwiseAbs2().asDiagonal();
      arrivals.push_back({to + static_cast<int64_t>(delay_s * 1e9), {source, to - period, to, moved, covariance}});
    }
  }
};

/// (e^T C^-1 e) of a pose: 3 in the mean if the covariance is right.
inline double normalised_error_squared(const robot_pose::Estimate& estimate, const PlanarPose& truth) {
  const PlanarPose& p = estimate.robot_in_map;
  const Eigen::Vector3d e(p.x_m - truth.x_m, p.y_m - truth.y_m, wrapped(p.theta_rad - truth.theta_rad));
  return e.dot(estimate.covariance.ldlt().solve(e));
}

}  // namespace takt::test
