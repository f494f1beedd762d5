// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/hal/devices.hpp>: hal, experimental.
// The way from a graph's device entry to a hardware node.
//
//     hal::Devices devices;
//     auto node = hal::make_device(registry.devices, {"laser", "laser_scanner", "sim", settings, folder, 1}, devices,
//     clock);
#pragma once
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <typeindex>

#include "hal/device_types.hpp"
#include "hal/settings/json.hpp"
#include "hal/settings/settings.hpp"
#include "hal/simulated.hpp"
#include "rt/time/clock.hpp"

namespace takt::hal {

class OwnFolder;

/// What a device needs to exist.
struct DeviceConfig {
  std::string id, kind, driver;
  nlohmann::json settings;          ///< one object; values with a unit as text ("0.24m") or as numbers in SI
  std::filesystem::path directory;  ///< relative paths in the settings start here
  uint64_t seed = 0;
  bool plugged =
      true;  ///< false: hardware need not be there. Its node knows sizes from settings and files, and never runs
};

/// What the devices of one process share. Must outlive the nodes. Composition thread only.
class Devices {
 public:
  Devices();
  ~Devices();
  /// What the drivers of one folder share, made when it is first asked for.
  template <class T>
  T& shared() {
    std::shared_ptr<void>& own = shared_[typeid(T)];
    if (!own) own = std::make_shared<T>();
    return *static_cast<T*>(own.get());
  }
  /// A folder of this process for the lines of doubles, made when it is first asked for; empty if that failed.
  const std::filesystem::path& folder();
  /// The simulated world of these devices, which lives as long as they do; the first one offered counts.
  void offer(const SimulatedWorld& world);
  /// Null: nothing is simulated.
  const SimulatedWorld* simulated() const { return simulated_; }
  SimulatorUse simulator_use() const { return simulated_ == nullptr ? SimulatorUse{} : simulated_->use(); }

 private:
  std::map<std::type_index, std::shared_ptr<void>> shared_;
  const SimulatedWorld* simulated_ = nullptr;
  std::unique_ptr<OwnFolder> folder_;
};

/// Makes the node of a device and opens the device (hardware only if it is `plugged`): everything that can be wrong
/// with files and settings is told here. Errors list the valid alternatives.
NodeResult make_device(const DeviceTypes& types, const DeviceConfig& config, Devices& devices, const Clock& clock);

}  // namespace takt::hal
