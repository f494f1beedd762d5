// SPDX-License-Identifier: Apache-2.0
#include "rt/msg/laser_scan.hpp"

#include "rt/msg/field_list.hpp"

namespace takt {

TAKT_FIELDS(LaserScan, TAKT_FIELD(LaserScan, first_angle_rad, "rad"), TAKT_FIELD(LaserScan, step_rad, "rad"),
            TAKT_FIELD(LaserScan, max_range_m, "m"), TAKT_FIELD(LaserScan, sweep_s, "s"),
            TAKT_FIELD(LaserScan, scan_number, "1"), TAKT_TRANSFORM_FIELDS(LaserScan, sensor_in_robot),
            TAKT_FIELD(LaserScan, range_m, "m"))

}  // namespace takt
