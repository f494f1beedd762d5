// SPDX-License-Identifier: Apache-2.0
#include "nodes/navigation/pilot.hpp"

#include <algorithm>

namespace takt::navigation {
namespace {

constexpr double kBrakingShare = 0.6;  // of the acceleration limit: the rest is for what the base answers late
constexpr double kTurnedTo_rad = 0.1;

/// Towards 0 left: as fast as braking still allows, and no faster than `gain` per unit at the end.
double approach(double left, double fastest, double acceleration, double gain) {
  const double size = std::abs(left);
  return std::copysign(std::min({fastest, std::sqrt(2 * kBrakingShare * acceleration * size), gain * size}), left);
}

double towards(double from, double to, double most) { return std::clamp(to, from - most, from + most); }

}  // namespace

Pilot::Pilot(const PilotParameters& parameters) : parameters_(parameters) { way_.reserve(parameters.most_places); }

bool Pilot::drive_to(std::span<const Place> way, std::optional<double> direction_rad) {
  if (way.size() < 2 || way.size() > parameters_.most_places) return false;
  way_.assign(way.begin(), way.end());
  corner_ = 1;
  direction_rad_ = direction_rad;
  turning_ = false;
  behaviour_ = Behaviour::drive_to;
  return true;
}

void Pilot::rotate(const PlanarPose& robot, double by_rad) {
  left_ = by_rad;
  last_theta_rad_ = robot.theta_rad;
  behaviour_ = Behaviour::rotate;
}

void Pilot::straight_ahead(const PlanarPose& robot, double by_m) {
  left_ = by_m;
  begin_ = robot;
  behaviour_ = Behaviour::straight_ahead;
}

double Pilot::approach_m_s(double left_m) const {
  return approach(left_m, parameters_.limits.speed_m_s, parameters_.limits.acceleration_m_s2, parameters_.gain);
}

double Pilot::approach_rad_s(double left_rad) const {
  return approach(left_rad, parameters_.limits.turn_rad_s, parameters_.limits.turn_acceleration_rad_s2,
                  parameters_.gain);
}

Velocity Pilot::step(const PlanarPose& robot, double dt_s) {
  const Velocity target = wanted(robot);
  const MotionLimits& limits = parameters_.limits;
  sent_.speed_m_s = towards(sent_.speed_m_s, target.speed_m_s, limits.acceleration_m_s2 * dt_s);
  sent_.turn_rad_s = towards(sent_.turn_rad_s, target.turn_rad_s, limits.turn_acceleration_rad_s2 * dt_s);
  return sent_;
}

Velocity Pilot::wanted(const PlanarPose& robot) {
  switch (behaviour_) {
    case Behaviour::drive_to: return follow(robot);
    case Behaviour::rotate: return turn(robot);
    case Behaviour::straight_ahead: return ahead(robot);
    case Behaviour::stand: break;
  }
  return {};
}

Velocity Pilot::turn(const PlanarPose& robot) {
  left_ -= wrapped(robot.theta_rad - last_theta_rad_);
  last_theta_rad_ = robot.theta_rad;
  if (std::abs(left_) <= parameters_.arrived_rad) {
    stand();
    return {};
  }
  return {0, approach_rad_s(left_)};
}

Velocity Pilot::ahead(const PlanarPose& robot) {
  const PlanarPose moved = between(begin_, robot);
  const double left_m = left_ - moved.x_m;
  if (std::abs(left_m) <= parameters_.arrived_m) {
    stand();
    return {};
  }
  const double speed = approach_m_s(left_m);
  // Back onto the line: it steers for a point of it that lies ahead in the direction of travel.
  const double wanted_rad = std::atan2(speed < 0 ? moved.y_m : -moved.y_m, parameters_.look_ahead_m);
  return {speed, approach_rad_s(wanted_rad - moved.theta_rad)};
}

double Pilot::in_line(double aside_rad) const {
  return std::max(0.0, 1 - 1.5 * std::abs(aside_rad) / parameters_.turn_first_rad);
}

double Pilot::corner_m_s(size_t corner) const {
  if (corner + 1 == way_.size()) return 0;
  const auto direction = [&](const Place& from, const Place& to) {
    return std::atan2(to.y_m - from.y_m, to.x_m - from.x_m);
  };
  const double sharp = wrapped(direction(way_[corner], way_[corner + 1]) - direction(way_[corner - 1], way_[corner]));
  return parameters_.limits.speed_m_s * std::max(0.1, in_line(sharp));
}

Velocity Pilot::follow(const PlanarPose& robot) {
  // How far along the present piece, and how far it is to its end.
  const auto piece = [&] {
    const Place &a = way_[corner_ - 1], &b = way_[corner_];
    const double length = std::hypot(b.x_m - a.x_m, b.y_m - a.y_m);
    const double ux = length > 0 ? (b.x_m - a.x_m) / length : 1, uy = length > 0 ? (b.y_m - a.y_m) / length : 0;
    return std::tuple(ux, uy, length, ux * (robot.x_m - a.x_m) + uy * (robot.y_m - a.y_m));
  };
  auto [ux, uy, length, done] = piece();
  for (; corner_ + 1 < way_.size() && done >= length - parameters_.arrived_m; std::tie(ux, uy, length, done) = piece())
    ++corner_;

  const Place& goal = way_.back();
  const bool last = corner_ + 1 == way_.size();
  const double to_goal_m = std::hypot(goal.x_m - robot.x_m, goal.y_m - robot.y_m);
  if (last && to_goal_m <= parameters_.arrived_m) {
    if (direction_rad_) rotate(robot, wrapped(*direction_rad_ - robot.theta_rad));
    else stand();
    return {};
  }
  const double aim = std::clamp(done + parameters_.look_ahead_m, 0.0, length);
  const Place& begin = way_[corner_ - 1];
  const double bearing =
      wrapped(std::atan2(begin.y_m + aim * uy - robot.y_m, begin.x_m + aim * ux - robot.x_m) - robot.theta_rad);
  turning_ = std::abs(bearing) > (turning_ ? kTurnedTo_rad : parameters_.turn_first_rad);
  const Velocity sideways{0, approach_rad_s(bearing)};
  if (turning_) return sideways;

  // As slowly as the corners ahead are sharp, and as it is out of line; a stop where it has to be turned to.
  double allowed = parameters_.limits.speed_m_s, ahead_m = last ? to_goal_m : std::max(length - done, 0.0);
  for (size_t corner = corner_;; ++corner) {
    const double before_m_s = approach_m_s(ahead_m);
    allowed = std::min(allowed, std::hypot(corner_m_s(corner), before_m_s));
    if (before_m_s >= parameters_.limits.speed_m_s || corner + 1 == way_.size()) break;
    ahead_m += std::hypot(way_[corner + 1].x_m - way_[corner].x_m, way_[corner + 1].y_m - way_[corner].y_m);
  }
  return {allowed * in_line(bearing), sideways.turn_rad_s};
}

}  // namespace takt::navigation
