// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/msg/laser_scan.hpp>: core, stable.
#pragma once
#include <cstdint>
#include <span>
#include <string_view>

#include "rt/msg/array.hpp"
#include "rt/msg/field_list.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/viewer.hpp"

namespace takt {

/// One sweep of a laser scanner, in its own plane. Capacity: count (beams).
struct LaserScan {
  static constexpr std::string_view type_name = "laser_scan";
  double first_angle_rad = 0;  ///< of range 0, counter-clockwise from the sensor's forward axis
  double step_rad = 0;
  double max_range_m = 0;
  double sweep_s = 0;  ///< time from the first to the last beam
  uint32_t scan_number = 0;
  Transform sensor_in_robot;
  Array<float> range_m;  ///< 0: no return
  void show(Viewer& to) const {
    to.scan({first_angle_rad, step_rad, range_m.items(), max_range_m, sweep_s});
    to.mounted(sensor_in_robot);
  }
  TAKT_FIELDS(LaserScan, (first_angle_rad, "rad"), (step_rad, "rad"), (max_range_m, "m"), (sweep_s, "s"),
              (scan_number, "1"), (sensor_in_robot), (range_m, "m"))
};

}  // namespace takt
