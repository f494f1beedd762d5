// SPDX-License-Identifier: Apache-2.0
#include "rt/msg/head.hpp"

#include "rt/msg/field_list.hpp"

namespace takt {

TAKT_FIELDS(HeadState, TAKT_FIELD(HeadState, pan_rad, "rad"), TAKT_FIELD(HeadState, tilt_rad, "rad"),
            TAKT_FIELD(HeadState, roll_rad, "rad"), TAKT_FIELD(HeadState, pan_rad_s, "rad/s"),
            TAKT_FIELD(HeadState, tilt_rad_s, "rad/s"), TAKT_FIELD(HeadState, moving, ""))
TAKT_FIELDS(HeadCommand, TAKT_FIELD(HeadCommand, pan_rad, "rad"), TAKT_FIELD(HeadCommand, tilt_rad, "rad"))

}  // namespace takt
