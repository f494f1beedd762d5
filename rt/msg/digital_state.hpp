// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <span>
#include <string_view>

#include "rt/msg/field.hpp"

namespace takt {

/// Digital inputs, one bit a line (bit 0: line 0).
struct DigitalState {
  static constexpr std::string_view type_name = "digital_state";
  uint32_t levels = 0, changed = 0;
  static std::span<const Field> fields();
  static void capacities(const Capacity&, std::span<uint32_t>) {}
};

}  // namespace takt
