// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/msg/odometry.hpp>: core, stable.
#pragma once
#include <cmath>
#include <cstdint>
#include <span>
#include <string_view>

#include "rt/msg/field_list.hpp"
#include "rt/msg/viewer.hpp"

namespace takt {

/// State of the mobile base in its drifting odometry frame.
struct Odometry {
  static constexpr std::string_view type_name = "odometry";
  double x_m = 0, y_m = 0, theta_rad = 0;  ///< theta: driving direction from the x axis
  double speed_m_s = 0, turn_rad_s = 0;
  void show(Viewer& to) const {
    to.pose({.x = x_m, .y = y_m, .qw = std::cos(theta_rad / 2), .qz = std::sin(theta_rad / 2)}, "odometry");
  }
  TAKT_FIELDS(Odometry, (x_m, "m"), (y_m, "m"), (theta_rad, "rad"), (speed_m_s, "m/s"), (turn_rad_s, "rad/s"))
};

}  // namespace takt
