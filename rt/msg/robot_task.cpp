// SPDX-License-Identifier: Apache-2.0
#include "rt/msg/robot_task.hpp"

#include "rt/msg/field_list.hpp"

namespace takt {

TAKT_FIELDS(RobotTask, TAKT_FIELD(RobotTask, number, "1"), TAKT_FIELD(RobotTask, text, ""))

}  // namespace takt
