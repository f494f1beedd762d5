// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/msg/velocity_command.hpp>: core, stable.
#pragma once
#include <cstdint>
#include <span>
#include <string_view>

#include "rt/msg/field_list.hpp"

namespace takt {

struct VelocityCommand {
  static constexpr std::string_view type_name = "velocity_command";
  double speed_m_s = 0, turn_rad_s = 0;
  TAKT_FIELDS(VelocityCommand, (speed_m_s, "m/s"), (turn_rad_s, "rad/s"))
};

}  // namespace takt
