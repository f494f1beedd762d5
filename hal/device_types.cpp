// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "hal/devices.hpp"
#include "hal/own_folder.hpp"

namespace takt::hal {
namespace {

/// Of every device.
std::vector<SettingInfo> common_settings() {
  using enum SettingKind;
  return {
      {"rate", "", rate, false, "releases per second of the device's node"},
      {"model", "", text, false, "name of the hardware model; of a laser's double lms200 or lms400"},
      {"silent_after", "", time, false, "without good data for so long it counts as lost; 3 periods, at least 300ms"},
      {"recovers_after", "", time, false, "good data for so long bring a lost device back; 500ms"},
  };
}

template <class List>
std::string names(const List& list) {
  std::string all;
  for (const auto& item : list) all.append(all.empty() ? "" : ", ").append(item.name);
  return all;
}

DeviceHealthSettings health_of(const DriverInfo& driver, Settings& settings) {
  DeviceHealthSettings health;
  const auto time = [&](const char* name, int64_t fallback_ns) {
    const double seconds = settings.quantity(name, Dimension::time, static_cast<double>(fallback_ns) * 1e-9);
    if (settings.has(name) && !(seconds > 0 && seconds < 1e6))
      settings.fail("`" + std::string(name) + "` is not in 0s..1000000s", "give the time after which a device counts");
    return std::llround(seconds * 1e9);
  };
  health.silent_after_ns = time("silent_after", 0);
  health.recovers_after_ns = time("recovers_after", health.recovers_after_ns);
  health.judges_frozen =
      driver.sort != DriverSort::recorded;  // one image may be recorded, and is given again and again
  return health;
}

/// Keys that no driver of the kind knows.
DeviceResult check_keys(const DeviceConfig& config, const DeviceKind& kind) {
  if (!config.settings.is_object() && !config.settings.is_null())
    return device_error(config.id, "the settings are no map", "write key: value");
  for (const auto& item : config.settings.items()) {
    const std::string& key = item.key();
    const bool known = key == "kind" || key == "driver" ||
                       std::any_of(kind.settings.begin(), kind.settings.end(),
                                   [&](const SettingInfo& s) { return s.name == key && kind.takes(config.driver, s); });
    if (known) continue;
    std::string all;
    for (const SettingInfo& s : kind.settings) {
      if (kind.takes(config.driver, s)) all.append(all.empty() ? "" : ", ").append(s.name);
    }
    return device_error(config.id, "unknown setting `" + key + "`", "driver `" + config.driver + "` knows: " + all);
  }
  return {};
}

}  // namespace

std::string_view to_text(SettingKind kind) {
  using enum SettingKind;
  switch (kind) {
    case path: return "path";
    case length: return "length (m, cm, mm)";
    case angle: return "angle (deg, rad)";
    case speed: return "speed (m/s)";
    case turn_rate: return "turn rate (deg/s, rad/s)";
    case time: return "time (s, ms)";
    case rate: return "rate (Hz)";
    case count: return "count";
    case number: return "number";
    case flag: return "true or false";
    case text: return "text";
    case map: return "map";
  }
  return "";
}

Devices::Devices() = default;

Devices::~Devices() = default;

const std::filesystem::path& Devices::folder() {
  std::error_code error;
  if (!folder_) folder_ = std::make_unique<OwnFolder>(std::filesystem::temp_directory_path(error), "takt-doubles-");
  return folder_->path();
}

void Devices::offer(const SimulatedWorld& world) {
  if (simulated_ == nullptr) simulated_ = &world;
}

MakeDevice hardware(MakeDevice closed) {
  return [closed = std::move(closed)](const DeviceConfig& config, Settings& settings, Devices& devices,
                                      const Clock& clock) -> NodeResult {
    NodeResult node = closed(config, settings, devices, clock);
    if (!node) return node;
    (*node)->declare();
    if (!config.plugged) (*node)->leave_closed();
    if (!config.plugged) return node;
    if (const auto result = (*node)->device().open(); !result) return tl::unexpected(result.error());
    if (const std::string broken = (*node)->broken_declaration(); !broken.empty())
      return device_failure(config.id, broken,
                            "make the settings say what the device does: rate, exposure, transfer, baud");
    return node;
  };
}

const DriverInfo* DeviceKind::driver(std::string_view called) const {
  const auto found =
      std::find_if(drivers.begin(), drivers.end(), [&](const DriverInfo& d) { return d.name == called; });
  return found == drivers.end() ? nullptr : &*found;
}

bool DeviceKind::takes(std::string_view called, const SettingInfo& setting) const {
  if (setting.driver.empty() || setting.driver == called) return true;
  const DriverInfo *own = driver(called), *of = driver(setting.driver);
  return own != nullptr && own->sort == DriverSort::doubled && of != nullptr && of->sort == DriverSort::hardware &&
         !setting.place;
}

bool DeviceKind::takes(std::string_view called, std::string_view setting) const {
  return std::any_of(settings.begin(), settings.end(),
                     [&](const SettingInfo& s) { return s.name == setting && takes(called, s); });
}

DeviceKind* DeviceTypes::known(std::string_view kind) {
  const auto found = std::find_if(kinds_.begin(), kinds_.end(), [&](const DeviceKind& k) { return k.name == kind; });
  return found == kinds_.end() ? nullptr : &*found;
}

const DeviceKind* DeviceTypes::find(std::string_view kind) const { return const_cast<DeviceTypes*>(this)->known(kind); }

void DeviceTypes::join(DeviceKind& kind, Addition addition) {
  if (kind.driver(addition.driver.name) != nullptr)
    throw std::logic_error("device kind " + std::string(kind.name) + " has two drivers " +
                           std::string(addition.driver.name));
  // Simulator and recordings are listed first, the double last.
  const auto behind = std::upper_bound(kind.drivers.begin(), kind.drivers.end(), addition.driver,
                                       [](const DriverInfo& a, const DriverInfo& b) { return a.sort < b.sort; });
  kind.drivers.insert(behind, std::move(addition.driver));
  kind.settings.insert(kind.settings.end(), addition.settings.begin(), addition.settings.end());
  // As their drivers are listed, those of all drivers first.
  std::stable_sort(kind.settings.begin(), kind.settings.end(), [&](const SettingInfo& a, const SettingInfo& b) {
    const auto place = [&](const SettingInfo& s) {
      return s.driver.empty() ? 0 : kind.driver(s.driver) - kind.drivers.data() + 1;
    };
    return place(a) < place(b);
  });
}

void DeviceTypes::add(DeviceKind kind) {
  if (known(kind.name) != nullptr) throw std::logic_error("there are two device kinds " + std::string(kind.name));
  const auto common = common_settings();
  kind.settings.insert(kind.settings.begin(), common.begin(), common.end());
  for (Addition& addition : waiting_)
    if (addition.kind == kind.name) join(kind, std::move(addition));
  std::erase_if(waiting_, [&](const Addition& addition) { return addition.kind == kind.name; });
  const auto behind = std::upper_bound(kinds_.begin(), kinds_.end(), kind,
                                       [](const DeviceKind& a, const DeviceKind& b) { return a.name < b.name; });
  kinds_.insert(behind, std::move(kind));
}

void DeviceTypes::add(std::string_view kind, DriverInfo driver, std::vector<SettingInfo> settings) {
  Addition addition{kind, std::move(driver), std::move(settings)};
  if (DeviceKind* there = known(kind)) join(*there, std::move(addition));
  else waiting_.push_back(std::move(addition));
}

NodeResult make_device(const DeviceTypes& types, const DeviceConfig& config, Devices& devices, const Clock& clock) {
  const DeviceKind* const kind = types.find(config.kind);
  if (kind == nullptr)
    return device_error(config.id, "unknown device kind `" + config.kind + "`", "known kinds: " + names(types.all()));
  const DriverInfo* const driver = kind->driver(config.driver);
  if (driver == nullptr)
    return device_error(config.id, config.kind + " has no driver `" + config.driver + "`",
                        "known drivers: " + names(kind->drivers));
  if (const auto keys = check_keys(config, *kind); !keys) return tl::unexpected(keys.error());
  Settings settings(config.id, config.settings, config.directory);
  const DeviceHealthSettings health = health_of(*driver, settings);
  NodeResult node = driver->make(config, settings, devices, clock);
  if (node) (*node)->set_health(health);
  return node;
}

}  // namespace takt::hal
