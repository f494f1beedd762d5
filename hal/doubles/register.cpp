// SPDX-License-Identifier: Apache-2.0
// Driver `double`: the driver of real hardware, and a double at the other end of its line.
#include "hal/doubles/doubled.hpp"
#include "hal/sim/worlds.hpp"

namespace takt {
namespace {

using namespace hal;

NodeResult make_doubled(const DeviceConfig& config, Settings& settings, Devices& devices, const Clock& clock) {
  const auto world = sim::world_of(config, devices);
  if (!world) return tl::unexpected(world.error());
  auto doubled = make_double(config, settings, **world, devices.folder(), clock);
  if (!doubled) return tl::unexpected(doubled.error());
  Settings of_driver(config.id, doubled->config.settings, config.directory);
  const MakeDevice driver =
      hardware([&doubled](const DeviceConfig& own, Settings& its, Devices& all, const Clock& time) {
        return doubled->driver(own, its, all, time, std::move(doubled->seams));
      });
  NodeResult node = driver(doubled->config, of_driver, devices, clock);
  if (node) (*node)->live_with(std::move(doubled->thread));
  return node;
}

}  // namespace

void register_doubles(DeviceTypes& types) {
  using enum SettingKind;
  const auto add = [&](std::string_view kind, const std::vector<SettingInfo>& own) {
    std::vector<SettingInfo> settings = {
        {"world", "double", path, true, "XML file of the simulated world that the double is in"},
        {"client", "double", text, false, "which <client> of the world is the robot; the first"},
        {"failures", "double", text, false,
         "how the double misbehaves and when, such as wrong_crc 2s..4s, frozen 6s..7s"},
    };
    settings.insert(settings.end(), own.begin(), own.end());
    types.add(
        kind,
        {"double", "the driver of the hardware at a double in the simulated world", make_doubled, DriverSort::doubled},
        std::move(settings));
  };
  add("stereo_camera",
      {
          {"lead", "double", time, false, "it exposes so long before the whole periods from the epoch; 25ms"},
      });
  add("laser_scanner", {});
  add("camera_head", {});
  add("mobile_base", {
                         {"drive", "double", text, false, "path (the world's) or command; path if the world has one"},
                     });
  add("digital_lines", {});
  add("interaction", {
                         {"script", "double", text, false, "who presses what when, such as 2s explore; 30s stop"},
                     });
}

}  // namespace takt
