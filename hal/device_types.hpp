// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/hal/device_types.hpp>: hal, experimental.
// Which device kinds and drivers there are.
//
//     void register_tube(hal::DeviceTypes& types) {  // in the driver's folder; its CMakeLists.txt says REGISTERS tube
//       types.add("laser_scanner", {"tube", "a scanner in a tube", hal::hardware(make_tube)},
//                 {{"radius", "tube", hal::SettingKind::length, true, "of the tube"}});
//     }
#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "hal/device_node.hpp"

namespace takt {
class Clock;
class Settings;
}  // namespace takt

namespace takt::hal {

struct DeviceConfig;
class Devices;

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

using NodeResult = tl::expected<std::unique_ptr<DeviceNode>, DeviceError>;
/// Makes the node and opens the device. What is wrong with settings is returned, with the valid alternatives.
using MakeDevice =
    std::function<NodeResult(const DeviceConfig& config, Settings& settings, Devices& devices, const Clock& clock)>;
/// The maker of a driver of real hardware from one of its closed node: what the device states before it is opened
/// binds it, and one that is not plugged stays closed.
MakeDevice hardware(MakeDevice closed);

/// What stands behind a driver.
enum class DriverSort : uint8_t {
  simulated,
  recorded,
  hardware,
  neighbour,  ///< another program gives what is real; it has no double
  doubled,
};

struct DriverInfo {
  std::string_view name, doc;
  MakeDevice make;
  DriverSort sort = DriverSort::hardware;
};

struct DeviceKind {
  std::string_view name, doc;
  /// The node without a device: ports to look at and to connect, never set up or run.
  std::function<std::unique_ptr<DeviceNode>()> shell;
  std::vector<DriverInfo> drivers;
  std::vector<SettingInfo> settings;

  /// Null: there is none of that name.
  const DriverInfo* driver(std::string_view called) const;
  /// A double takes what the driver at the other end of its line takes, but for where the device is.
  bool takes(std::string_view driver, const SettingInfo& setting) const;
  bool takes(std::string_view driver, std::string_view setting) const;
};

/// The device kinds of a program. A value: no list of the process. Not changed once it is used; reading is safe in any
/// thread.
class DeviceTypes {
 public:
  /// Throws std::logic_error if there is such a kind.
  void add(DeviceKind kind);
  /// A driver of a kind, which may be added later; settings that have a driver are those of this one. Throws
  /// std::logic_error if the kind has such a driver.
  void add(std::string_view kind, DriverInfo driver, std::vector<SettingInfo> settings);
  /// By name.
  std::span<const DeviceKind> all() const { return kinds_; }
  /// Null: there is none of that name.
  const DeviceKind* find(std::string_view kind) const;

 private:
  struct Addition {
    std::string_view kind;
    DriverInfo driver;
    std::vector<SettingInfo> settings;
  };
  DeviceKind* known(std::string_view kind);
  static void join(DeviceKind& kind, Addition addition);
  std::vector<DeviceKind> kinds_;
  std::vector<Addition> waiting_;  ///< drivers whose kind is not there yet
};

}  // namespace takt::hal
