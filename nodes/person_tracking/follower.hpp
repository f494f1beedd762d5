// SPDX-License-Identifier: Apache-2.0
// How the robot follows a person.
#pragma once
#include <algorithm>
#include <cmath>

#include "rt/msg/velocity_command.hpp"

namespace takt::person_tracking {

struct FollowerParameters {
  double distance_m = 1.5;                   ///< that the robot keeps
  double speed_gain = 0.8, turn_gain = 1.5;  ///< k_v, k_w; 1/s
  double speed_max_m_s = 0.8, turn_max_rad_s = 0.8;
  double reverse_max_m_s = 0;  ///< backwards there are no eyes
};

/// v = k_v (r - distance), w = k_w bearing, within their limits. The person's place in the robot frame (x right, y
/// ahead); the bearing is positive to the left, as a turn is.
inline VelocityCommand set_point(const FollowerParameters& p, double x_m, double y_m) {
  const double range = std::hypot(x_m, y_m), bearing = std::atan2(-x_m, y_m);
  return {std::clamp(p.speed_gain * (range - p.distance_m), -p.reverse_max_m_s, p.speed_max_m_s),
          std::clamp(p.turn_gain * bearing, -p.turn_max_rad_s, p.turn_max_rad_s)};
}

}  // namespace takt::person_tracking
