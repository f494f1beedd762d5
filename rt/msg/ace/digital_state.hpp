// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/ace/digital_state.hpp>: ace, experimental.
#pragma once
#include <cstdint>
#include <span>
#include <string_view>

#include "rt/msg/field_list.hpp"

namespace takt {

/// Digital inputs, one bit a line (bit 0: line 0).
struct DigitalState {
  static constexpr std::string_view type_name = "digital_state";
  uint32_t levels = 0, changed = 0;
  TAKT_FIELDS(DigitalState, (levels, ""), (changed, ""))
};

}  // namespace takt
