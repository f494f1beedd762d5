// SPDX-License-Identifier: Apache-2.0
#include "rt/msg/odometry.hpp"

#include "rt/msg/field_list.hpp"

namespace takt {

TAKT_FIELDS(Odometry, TAKT_FIELD(Odometry, x_m, "m"), TAKT_FIELD(Odometry, y_m, "m"),
            TAKT_FIELD(Odometry, theta_rad, "rad"), TAKT_FIELD(Odometry, speed_m_s, "m/s"),
            TAKT_FIELD(Odometry, turn_rad_s, "rad/s"))

}  // namespace takt
