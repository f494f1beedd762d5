// SPDX-License-Identifier: Apache-2.0
#include "hal/driver_parts.hpp"
#include "hal/head/can_head.hpp"
#include "hal/head/can_head_driver.hpp"
#include "hal/head/head_node.hpp"

namespace takt::hal {

NodeResult make_can_head(const DeviceConfig& config, Settings& settings, Devices&, const Clock& clock) {
  head::CanHeadSettings head{.interface = interface_of(settings), .eyelids = settings.flag("eyelids", true)};
  std::unique_ptr<CameraHead> device = std::make_unique<head::CanHead>(config.id, std::move(head), clock);
  return closed<HeadNode>(std::move(device), settings);
}

}  // namespace takt::hal

namespace takt {

void register_camera_head(hal::DeviceTypes& types) {
  using enum hal::SettingKind;
  types.add({"camera_head",
             "gives `state`, takes `command` and `lids`",
             [] { return std::make_unique<HeadNode>(nullptr); },
             {},
             {}});
  types.add("camera_head", {"can", "the camera head on a CAN bus", hal::hardware(hal::make_can_head)},
            {
                {"interface", "can", text, true, "network interface, for instance can0; unix:PATH for a double", true},
                {"eyelids", "can", flag, false, "open unless `lids` closes them, closed at the stop; true"},
            });
}

}  // namespace takt
