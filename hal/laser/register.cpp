// SPDX-License-Identifier: Apache-2.0
#include "hal/device_types.hpp"
#include "hal/laser/laser_node.hpp"

namespace takt {

void register_laser_scanner(hal::DeviceTypes& types) {
  using enum hal::SettingKind;
  types.add({"laser_scanner",
             "gives `scan`",
             [] { return std::make_unique<LaserNode>(nullptr); },
             {},
             {
                 {"mount", "", map, false, "sensor in the robot frame: {x, y, z, yaw, pitch, roll}"},
             }});
}

}  // namespace takt
