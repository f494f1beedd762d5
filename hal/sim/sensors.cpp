// SPDX-License-Identifier: Apache-2.0
#include "hal/sim/sensors.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hal/sim/random.hpp"

namespace takt::sim {
namespace {
constexpr int64_t kTickNs = 10'000'000;
}

void scan(const Simulation& simulation, const LaserModel& model, int64_t first_ns, std::span<float> range_m,
          Snapshot& met) {
  simulation.look(first_ns, met);
  const Transform& t = model.sensor_in_robot;
  const Mat3 sensor_in_robot = Eigen::Quaterniond(t.qw, t.qx, t.qy, t.qz).toRotationMatrix();
  const double step = model.beams > 1 ? model.fov_rad / (model.beams - 1) : 0.0;
  const size_t beams = std::min<size_t>(model.beams, range_m.size());
  for (size_t i = 0; i < beams; ++i) {
    const double share = beams > 1 ? static_cast<double>(i) / static_cast<double>(beams - 1) : 0.0;
    const RobotState s = simulation.robot(first_ns + static_cast<int64_t>(share * model.sweep_s * 1e9));
    const Mat3 robot_in_map = Eigen::AngleAxisd(s.theta_rad - std::numbers::pi / 2, Vec3::UnitZ()).toRotationMatrix();
    const double angle = -model.fov_rad / 2 + static_cast<double>(i) * step;  // counter-clockwise from the y axis
    const Vec3 origin = Vec3(s.x_m, s.y_m, 0) + robot_in_map * Vec3(t.x, t.y, t.z);
    const Vec3 direction = robot_in_map * (sensor_in_robot * Vec3(-std::sin(angle), std::cos(angle), 0));
    const double range = simulation.stage().cast_ray(met, origin, direction, model.max_range_m);
    const double noise =
        model.sigma_m * normal(simulation.seed() ^ 0x1A5E6, static_cast<uint64_t>(first_ns - simulation.epoch_ns()), i);
    range_m[i] = range >= model.max_range_m ? 0.0f : static_cast<float>(std::max(range + noise, 0.001));
  }
}

DriftingOdometry::DriftingOdometry(const Simulation& simulation, const OdometryModel& model, uint64_t seed)
    : simulation_(simulation), model_(model), seed_(mix(seed, 0x0D0)) {
  restart();
}

void DriftingOdometry::restart() {
  tick_ = 0;
  x_ = y_ = theta_ = 0;
  bias_ = model_.turn_bias_rad_s * normal(seed_, 0);
  previous_ = simulation_.robot(simulation_.epoch_ns());
}

void DriftingOdometry::step() {
  ++tick_;
  const RobotState now = simulation_.robot(simulation_.epoch_ns() + tick_ * kTickNs);
  const double dx = now.x_m - previous_.x_m, dy = now.y_m - previous_.y_m;
  // Distance along the heading (wheels do not slide), sign included.
  const double middle =
      previous_.theta_rad + std::remainder(now.theta_rad - previous_.theta_rad, 2 * std::numbers::pi) / 2;
  const double distance = (dx * std::cos(middle) + dy * std::sin(middle)) * (1 + model_.scale_error);
  const double turn =
      std::remainder(now.theta_rad - previous_.theta_rad, 2 * std::numbers::pi) * (1 + model_.turn_scale_error) +
      bias_ * 0.01;
  x_ += distance * std::cos(theta_ + turn / 2);
  y_ += distance * std::sin(theta_ + turn / 2);
  theta_ += turn;
  bias_ += model_.turn_bias_walk * 0.1 * normal(seed_, static_cast<uint64_t>(tick_));  // sqrt(10 ms) = 0.1 sqrt(s)
  previous_ = now;
}

BaseReading DriftingOdometry::at(int64_t at_ns) {
  const int64_t since = std::max<int64_t>(0, at_ns - simulation_.epoch_ns());
  if (since / kTickNs < tick_) restart();
  while (tick_ < since / kTickNs) step();
  BaseReading r;
  r.status = ReadStatus::ok;
  r.stamp_ns = at_ns;
  const RobotState now = simulation_.robot(at_ns);
  r.speed_m_s = now.speed_m_s * (1 + model_.scale_error);
  r.turn_rad_s = now.turn_rad_s * (1 + model_.turn_scale_error) + bias_;
  r.x_m = x_;
  r.y_m = y_;
  r.theta_rad = theta_;
  integrate_arc(r.speed_m_s, r.turn_rad_s, static_cast<double>(since - tick_ * kTickNs) * 1e-9, r.x_m, r.y_m,
                r.theta_rad);
  r.theta_rad = std::remainder(r.theta_rad, 2 * std::numbers::pi);
  r.blocked = simulation_.blocked();
  return r;
}

}  // namespace takt::sim
