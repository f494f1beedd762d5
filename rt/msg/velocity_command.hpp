// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/msg/velocity_command.hpp>: core, stable.
#pragma once
#include <cstdint>
#include <span>
#include <string_view>

#include "rt/msg/field.hpp"

namespace takt {

struct VelocityCommand {
  static constexpr std::string_view type_name = "velocity_command";
  double speed_m_s = 0, turn_rad_s = 0;
  static std::span<const Field> fields();
  static void capacities(const Capacity&, std::span<uint32_t>) {}
};

}  // namespace takt
