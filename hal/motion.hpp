// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/hal/motion.hpp>: hal, experimental.
// How simulated mechanisms move.
#pragma once
#include <algorithm>
#include <cmath>

namespace takt {

/// One axis of a simulated head: limited in reach, speed and acceleration.
struct Axis {
  double reach_rad = 0, speed_rad_s = 0, acceleration_rad_s2 = 0;
};

/// `from` moved towards `to` by at most `step`.
inline double towards(double from, double to, double step) { return from + std::clamp(to - from, -step, step); }

/// Position and speed after one tick of moving towards `target_rad`.
inline void step_axis(const Axis& axis, double target_rad, double tick_s, double& position_rad, double& speed_rad_s) {
  position_rad = std::clamp(position_rad + speed_rad_s * tick_s, -axis.reach_rad, axis.reach_rad);  // mechanical stop
  const double error = target_rad - position_rad;
  // Fastest speed from which the rest of the way suffices to brake; close to the target one tick must not overshoot it.
  const double braking = std::sqrt(2 * axis.acceleration_rad_s2 * std::abs(error)) * 0.9;
  const double wanted = std::copysign(std::min({axis.speed_rad_s, braking, std::abs(error) / tick_s}), error);
  speed_rad_s = towards(speed_rad_s, wanted, axis.acceleration_rad_s2 * tick_s);
  // Arrived: there, or just past it with a speed that one tick takes away.
  const bool passed = error * speed_rad_s < 0 && std::abs(error) < std::abs(speed_rad_s) * tick_s;
  if ((std::abs(error) < 1e-4 || passed) && std::abs(speed_rad_s) < 2 * axis.acceleration_rad_s2 * tick_s) {
    position_rad = target_rad;
    speed_rad_s = 0;
  }
}

}  // namespace takt
