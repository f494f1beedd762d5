// SPDX-License-Identifier: Apache-2.0
#include "hal/base/base_node.hpp"
#include "hal/base/can_base.hpp"
#include "hal/base/can_base_driver.hpp"
#include "hal/driver_parts.hpp"

namespace takt::hal {

NodeResult make_can_base(const DeviceConfig& config, Settings& settings, Devices&, const Clock& clock) {
  base::CanBaseSettings base{.interface = interface_of(settings)};
  base.wheels.step_m = settings.quantity("wheel_step", Dimension::length, base.wheels.step_m);
  base.wheels.track_m = settings.quantity("track", Dimension::length, base.wheels.track_m);
  if (base.wheels.step_m <= 0 || base.wheels.track_m <= 0)
    settings.fail("`wheel_step` or `track` is not positive", "measure both: they are the base's geometry");
  std::unique_ptr<MobileBase> device = std::make_unique<base::CanBase>(config.id, std::move(base), clock);
  return closed<BaseNode>(std::move(device), settings);
}

}  // namespace takt::hal

namespace takt {

void register_mobile_base(hal::DeviceTypes& types) {
  using enum hal::SettingKind;
  types.add({"mobile_base",
             "gives `odometry`, takes `velocity` and `stop`",
             [] { return std::make_unique<BaseNode>(nullptr); },
             {},
             {}});
  types.add("mobile_base", {"can", "the mobile base on a CAN bus", hal::hardware(hal::make_can_base)},
            {
                {"interface", "can", text, true, "network interface, for instance can0; unix:PATH for a double", true},
                {"wheel_step", "can", length, false, "way of a wheel per encoder count; 0.05mm"},
                {"track", "can", length, false, "distance of the two wheels; 0.5m"},
            });
}

}  // namespace takt
