// SPDX-License-Identifier: Apache-2.0
#include "hal/device_types.hpp"
#include "hal/object_sensor/object_sensor_node.hpp"

namespace takt {

void register_object_sensor(hal::DeviceTypes& types) {
  types.add({"object_sensor", "gives `objects`", [] { return std::make_unique<ObjectSensorNode>(nullptr); }, {}, {}});
}

}  // namespace takt
