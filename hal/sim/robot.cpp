// SPDX-License-Identifier: Apache-2.0
#include "hal/sim/robot.hpp"

#include <algorithm>
#include <cmath>

#include "hal/motion.hpp"
#include "hal/sim/stage.hpp"

namespace takt::sim {
namespace {

constexpr double kTickS = 0.01;
constexpr double kMaxTurn = 1.2, kMaxTurnAcceleration = 2.5;  // our choice: not documented for the platform

/// The command in force at an instant: the newest whose time has come. `count` commands were ever given.
const PendingCommand* in_force(const std::array<PendingCommand, 64>& ring, uint32_t count, int64_t at_ns) {
  const uint32_t kept = std::min<uint32_t>(count, static_cast<uint32_t>(ring.size()));
  for (uint32_t back = 1; back <= kept; ++back) {
    const PendingCommand& command = ring[(count - back) % ring.size()];
    if (command.at_ns <= at_ns) return &command;
  }
  return nullptr;
}

template <size_t N>
bool reaches(const History<N>& history, int64_t since_epoch_ns) {
  const int64_t last = history.last_tick();
  return last == 0 || last * History<N>::kTickNs >= since_epoch_ns;
}

}  // namespace

void integrate_arc(double v, double w, double dt, double& x, double& y, double& theta) {
  if (std::abs(w) > 1e-6) {
    const double next = theta + w * dt;
    x += v / w * (std::sin(next) - std::sin(theta));
    y -= v / w * (std::cos(next) - std::cos(theta));
    theta = next;
  } else {
    x += v * std::cos(theta) * dt;
    y += v * std::sin(theta) * dt;
    theta += w * dt;
  }
}

Robot::Robot(const Stage& stage, size_t index)
    : stage_(stage),
      index_(index),
      client_(stage.world().clients.at(index)),
      path_(client_.path),
      base_({client_.x_m, client_.y_m, client_.theta_rad, 0, 0}),
      head_({0, 0, 0, 0}) {
  if (path_.empty()) set_drive(Drive::command);
}

RobotState Robot::state(int64_t at_ns) const {
  const int64_t since = at_ns - stage_.epoch_ns();
  if (drive() == Drive::path) return path_.at(static_cast<double>(since) * 1e-9);
  const int64_t tick = std::clamp<int64_t>(since / History<5>::kTickNs, 0, base_.last_tick());
  const auto s = base_.at_tick(tick);
  RobotState robot{s[0], s[1], s[2], s[3], s[4]};
  // Within a tick, and beyond the settled horizon, the robot goes on along its arc.
  const double dt = std::max<double>(0, static_cast<double>(since - tick * History<5>::kTickNs)) * 1e-9;
  integrate_arc(robot.speed_m_s, robot.turn_rad_s, dt, robot.x_m, robot.y_m, robot.theta_rad);
  return robot;
}

void Robot::command_base(double speed, double turn, int64_t at_ns) {
  base_commands_[base_command_count_++ % base_commands_.size()] = {at_ns + kLatencyNs, speed, turn};
}

void Robot::advance_base(int64_t now_ns) {
  if (drive() == Drive::path) return;
  const int64_t last = (now_ns + kLatencyNs - stage_.epoch_ns()) / History<5>::kTickNs;
  // Nobody has moved it yet: a driver that was started again in a long run need not live through all of it.
  if (base_command_count_ == 0) return base_.stay_until(last);
  for (int64_t tick = base_.last_tick() + 1; tick <= last; ++tick) step_base(tick);
}

void Robot::step_base(int64_t tick) {
  auto s = base_.at_tick(tick - 1);
  double speed = 0, turn = 0;
  const int64_t from_ns = stage_.epoch_ns() + (tick - 1) * History<5>::kTickNs;
  if (const auto* command = in_force(base_commands_, base_command_count_, from_ns)) {
    if (from_ns - command->at_ns <= kWatchdogNs) {
      speed = std::clamp(command->a, -kMaxSpeed, kMaxSpeed);
      turn = std::clamp(command->b, -kMaxTurn, kMaxTurn);
    }
  }
  double x = s[0], y = s[1], theta = s[2];
  integrate_arc(s[3], s[4], kTickS, x, y, theta);
  const bool refuse = stage_.refuses(index_, Vec2(s[0], s[1]), Vec2(x, y), from_ns);
  blocked_.store(refuse || (blocked_.load() && s[3] == 0 && speed > 0), std::memory_order_relaxed);
  if (refuse) {
    // The step is refused; turning on the spot stays possible (round footprint).
    s[2] = theta;
    s[3] = 0;
  } else {
    s[0] = x;
    s[1] = y;
    s[2] = theta;
    s[3] = towards(s[3], speed, kMaxAcceleration * kTickS);
  }
  s[4] = towards(s[4], turn, kMaxTurnAcceleration * kTickS);
  base_.append(s);
}

HeadReading Robot::head(int64_t at_ns) const {
  const int64_t since = at_ns - stage_.epoch_ns();
  const int64_t tick = std::clamp<int64_t>(since / History<4>::kTickNs, 0, head_.last_tick());
  const auto s = head_.at_tick(tick);
  const double dt = std::clamp<double>(static_cast<double>(since - tick * History<4>::kTickNs) * 1e-9, 0.0, kTickS);
  HeadReading r;
  r.status = ReadStatus::ok;
  r.stamp_ns = at_ns;
  const HeadLimits limits = head_limits();
  r.pan_rad = std::clamp(s[0] + dt * s[2], -limits.pan_rad, limits.pan_rad);
  r.tilt_rad = std::clamp(s[1] + dt * s[3], -limits.tilt_rad, limits.tilt_rad);
  r.pan_rad_s = s[2];
  r.tilt_rad_s = s[3];
  r.moving = std::abs(s[2]) > 1e-3 || std::abs(s[3]) > 1e-3;
  return r;
}

void Robot::command_head(double pan, double tilt, int64_t at_ns) {
  head_commands_[head_command_count_++ % head_commands_.size()] = {at_ns + kLatencyNs, pan, tilt};
}

void Robot::advance_head(int64_t now_ns) {
  const int64_t last = (now_ns + kLatencyNs - stage_.epoch_ns()) / History<4>::kTickNs;
  if (head_command_count_ == 0) return head_.stay_until(last);
  for (int64_t tick = head_.last_tick() + 1; tick <= last; ++tick) step_head(tick);
}

void Robot::step_head(int64_t tick) {
  auto s = head_.at_tick(tick - 1);
  const HeadLimits limits = head_limits();
  const auto* command =
      in_force(head_commands_, head_command_count_, stage_.epoch_ns() + (tick - 1) * History<4>::kTickNs);
  const double target[2] = {command ? command->a : 0, command ? command->b : 0};
  const Axis axes[2] = {{limits.pan_rad, limits.pan_rad_s, limits.acceleration_rad_s2},
                        {limits.tilt_rad, limits.tilt_rad_s, limits.acceleration_rad_s2}};
  for (size_t axis = 0; axis < 2; ++axis) step_axis(axes[axis], target[axis], kTickS, s[axis], s[axis + 2]);
  head_.append(s);
}

bool Robot::base_settled(int64_t at_ns) const {
  return drive() == Drive::path || reaches(base_, at_ns - stage_.epoch_ns());
}
bool Robot::head_settled(int64_t at_ns) const { return reaches(head_, at_ns - stage_.epoch_ns()); }

}  // namespace takt::sim
