// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/ace/action.hpp>: ace, experimental.
#pragma once
#include <cstdint>
#include <span>
#include <string_view>

#include "rt/msg/field_list.hpp"

namespace takt {

/// An action of the semantic network to be carried out. State and not an event: repeated until another one comes.
struct ActionCommand {
  static constexpr std::string_view type_name = "action_command";
  uint32_t number = 0;       ///< 0: none yet
  char action[32] = {};      ///< ended by 0
  char objects[4][32] = {};  ///< names of the objects, in the order of the action's roles; empty: no such role
  TAKT_FIELDS(ActionCommand, (number, "1"), (action, ""), (objects, ""))
};

/// What became of an action (ActionOutcome::state).
namespace action_state {
constexpr uint8_t none = 0, under_way = 1, done = 2, refused = 3, failed = 4;
}

/// How far the action of the newest command is.
struct ActionOutcome {
  static constexpr std::string_view type_name = "action_outcome";
  uint32_t number = 0;  ///< of the command; 0: none yet
  uint8_t state = action_state::none;
  double duration_s = 0;  ///< so far, or of the whole
  char reason[128] = {};  ///< why it was refused or has failed; ended by 0
  TAKT_FIELDS(ActionOutcome, (number, "1"), (state, ""), (duration_s, "s"), (reason, ""))
};

}  // namespace takt
