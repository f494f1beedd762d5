// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <takt/hal/devices.hpp>
#include <takt/registry.hpp>

#include "drivers.hpp"
#include "heater.hpp"

/// The kind `thermometer` with its drivers `sysfs` and `sim`, and the node type `heater`.
inline void register_room(takt::Registry& registry) {
  using namespace takt::hal;
  const auto sysfs = [](const DeviceConfig& config, takt::Settings& settings, Devices&,
                        const takt::Clock&) -> NodeResult {
    auto path = settings.path("path", true);
    if (settings.error()) return tl::unexpected(*settings.error());
    return std::make_unique<ThermometerNode>(std::make_unique<SysfsThermometer>(config.id, path.string()));
  };
  const auto sim = [](const DeviceConfig&, takt::Settings& settings, Devices&, const takt::Clock&) -> NodeResult {
    const double slope = settings.quantity("slope", takt::Dimension::number, 0.5);
    if (settings.error()) return tl::unexpected(*settings.error());
    return std::make_unique<ThermometerNode>(std::make_unique<SimulatedThermometer>(slope));
  };
  registry.nodes.add<Heater>("heater", takt::Layer::perception, "heats a cold room");
  DeviceKind kind;
  kind.name = "thermometer", kind.doc = "gives `temperature`";
  kind.shell = [] { return std::make_unique<ThermometerNode>(nullptr); };
  kind.settings = {{"rate", "", SettingKind::rate, false, "releases per second of the device's node"}};
  registry.devices.add(std::move(kind));
  registry.devices.add("thermometer", {"sysfs", "a sensor of the kernel", hardware(sysfs), DriverSort::hardware},
                       {{"path", "sysfs", SettingKind::path, true, "its file, /sys/class/thermal/thermal_zone0/temp"}});
  registry.devices.add("thermometer", {"sim", "a room that gets warmer", sim, DriverSort::simulated},
                       {{"slope", "sim", SettingKind::number, false, "degrees per second; 0.5"}});
}
