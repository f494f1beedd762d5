// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/ace/head.hpp>: ace, experimental.
#pragma once
#include <cstdint>
#include <span>
#include <string_view>

#include "rt/msg/field_list.hpp"

namespace takt {

/// State of the camera head: pan about z (left positive), tilt about x (up positive).
struct HeadState {
  static constexpr std::string_view type_name = "head_state";
  double pan_rad = 0, tilt_rad = 0, roll_rad = 0;
  double pan_rad_s = 0, tilt_rad_s = 0;
  uint8_t moving = 0;
  TAKT_FIELDS(HeadState, (pan_rad, "rad"), (tilt_rad, "rad"), (roll_rad, "rad"), (pan_rad_s, "rad/s"),
              (tilt_rad_s, "rad/s"), (moving, ""))
};

struct HeadCommand {
  static constexpr std::string_view type_name = "head_command";
  double pan_rad = 0, tilt_rad = 0;
  TAKT_FIELDS(HeadCommand, (pan_rad, "rad"), (tilt_rad, "rad"))
};

}  // namespace takt
