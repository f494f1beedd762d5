// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/hal/device_types.hpp>: hal, experimental.
// Which device kinds and drivers there are.
#pragma once
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace takt::hal {

enum class SettingKind : uint8_t { path, length, angle, speed, turn_rate, time, rate, count, number, flag, text, map };
std::string_view to_text(SettingKind kind);

/// One key that a device entry (or its profile entry) may have. `driver` empty: the same for every driver of the kind.
struct SettingInfo {
  std::string_view name, driver;
  SettingKind kind;
  bool required;
  std::string_view doc;
  bool place = false;  ///< says where the device is: a double brings its own
};
struct DriverInfo {
  std::string_view name, doc;
};
struct DeviceKind {
  std::string_view name, doc;
  std::span<const DriverInfo> drivers;
  std::span<const SettingInfo> settings;
};

/// A double takes what the driver at the other end of its line takes, but for where the device is.
bool takes(std::string_view driver, const SettingInfo& setting);

/// The device kinds of a program. A value: no list of the process.
class DeviceTypes {
 public:
  void add(const DeviceKind& kind) { kinds_.push_back(kind); }
  std::span<const DeviceKind> all() const { return kinds_; }
  /// Null: there is none of that name.
  const DeviceKind* find(std::string_view kind) const;

 private:
  std::vector<DeviceKind> kinds_;
};

/// The devices of the tree.
void register_devices(DeviceTypes& types);

}  // namespace takt::hal
