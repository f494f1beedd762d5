// SPDX-License-Identifier: Apache-2.0
// The devices of hal/ as the loader sees them. Apart from the loader, so that its tests need no device.
#include <algorithm>

#include "graph/language/catalogue.hpp"
#include "graph/language/registry.hpp"
#include "hal/device_types.hpp"

namespace takt::graph {
namespace {

using Kind = DeviceSetting::Kind;

/// Ports of a hardware node, asked of the node itself.
std::vector<DevicePort> ports_of(const hal::DeviceKind& kind) {
  const auto node = kind.shell();
  std::vector<DevicePort> ports;
  for (const auto* input : node->inputs())
    ports.push_back({std::string(input->name()), &input->type(), true, std::string(input->doc())});
  for (const auto* output : node->outputs())
    ports.push_back({std::string(output->name()), &output->type(), false, std::string(output->doc())});
  return ports;
}

DeviceSetting plain(const hal::SettingInfo& info) {
  DeviceSetting setting;
  setting.name = info.name;
  setting.required = info.required;
  setting.doc = info.doc;
  switch (info.kind) {
    case hal::SettingKind::path: setting.kind = Kind::path; break;
    case hal::SettingKind::length: setting.kind = Kind::number, setting.unit = "m"; break;
    case hal::SettingKind::angle: setting.kind = Kind::number, setting.unit = "rad"; break;
    case hal::SettingKind::speed: setting.kind = Kind::number, setting.unit = "m/s"; break;
    case hal::SettingKind::turn_rate: setting.kind = Kind::number, setting.unit = "rad/s"; break;
    case hal::SettingKind::time: setting.kind = Kind::number, setting.unit = "s"; break;
    case hal::SettingKind::rate: setting.kind = Kind::number; break;
    case hal::SettingKind::number: setting.kind = Kind::number; break;
    case hal::SettingKind::count: setting.kind = Kind::integer, setting.low = 0; break;
    case hal::SettingKind::flag: setting.kind = Kind::flag; break;
    case hal::SettingKind::text: setting.kind = Kind::text; break;
    case hal::SettingKind::map: break;
  }
  return setting;
}

void add(std::vector<DeviceSetting>& settings, const hal::SettingInfo& info) {
  const bool has = std::any_of(settings.begin(), settings.end(), [&](const auto& s) { return s.name == info.name; });
  if (has) return;                  // a double takes the settings of two drivers
  if (info.name == "rate") return;  // the loader's own, of every device
  if (info.kind != hal::SettingKind::map) return settings.push_back(plain(info));
  // The only map there is places the device on the robot.
  for (const char* axis : {"x", "y", "z", "yaw", "pitch", "roll"}) {
    DeviceSetting setting;
    setting.name = std::string(info.name) + "." + axis;
    setting.kind = Kind::number;
    setting.unit = std::string_view(axis).size() == 1 ? "m" : "rad";
    setting.doc = info.doc;
    settings.push_back(std::move(setting));
  }
}

}  // namespace

DeviceCatalogue catalogue(const hal::DeviceTypes& types) {
  DeviceCatalogue known;
  for (const auto& info : types.all()) {
    DeviceKindEntry kind;
    kind.name = info.name;
    kind.doc = info.doc;
    kind.ports = ports_of(info);
    for (const auto& driver : info.drivers)
      kind.drivers.push_back({std::string(driver.name), std::string(driver.doc), {}});
    for (const auto& setting : info.settings) {
      if (setting.driver.empty()) add(kind.settings, setting);
      for (auto& driver : kind.drivers)
        if (!setting.driver.empty() && info.takes(driver.name, setting)) add(driver.settings, setting);
    }
    known.kinds[kind.name] = std::move(kind);
  }
  return known;
}

Loaded load(const std::filesystem::path& file, const LoadOptions& options, const Registry& registry) {
  return load(file, options, registry.nodes, catalogue(registry.devices));
}

}  // namespace takt::graph
