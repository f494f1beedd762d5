// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/ace/robot_task.hpp>: ace, experimental.
#pragma once
#include <cstdint>
#include <span>
#include <string_view>

#include "rt/msg/array.hpp"
#include "rt/msg/field_list.hpp"

namespace takt {

/// What somebody wants of the robot, such as a goal in words. State and not an event: repeated until another one comes.
/// Capacity: count (characters).
struct RobotTask {
  static constexpr std::string_view type_name = "task";
  uint32_t number = 0;  ///< 0: none yet; another number is another task, its text may be the same
  Array<char> text;
  TAKT_FIELDS(RobotTask, (number, "1"), (text, ""))
};

}  // namespace takt
