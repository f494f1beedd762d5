// SPDX-License-Identifier: Apache-2.0
#include "rt/msg/velocity_command.hpp"

#include "rt/msg/field_list.hpp"

namespace takt {

TAKT_FIELDS(VelocityCommand, TAKT_FIELD(VelocityCommand, speed_m_s, "m/s"),
            TAKT_FIELD(VelocityCommand, turn_rad_s, "rad/s"))

}  // namespace takt
