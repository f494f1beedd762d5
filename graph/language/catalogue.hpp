// SPDX-License-Identifier: Apache-2.0
// What the loader must know of devices, as plain data: kinds with their ports, drivers and settings.
#pragma once
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "graph/language/graph.hpp"
#include "hal/device_types.hpp"
#include "rt/node.hpp"

namespace takt::graph {

/// One setting of a device. "mount.x" is `x` in the map `mount`.
struct DeviceSetting {
  enum class Kind : uint8_t { number, integer, flag, text, choice, path };
  std::string name;
  Kind kind = Kind::text;
  std::string unit;                ///< of a number: "m", "rad", "s" ..., "" for counts and pure numbers
  std::vector<std::string> words;  ///< of a choice
  std::optional<double> low, high;
  bool required = false;
  std::string doc;
};

struct DevicePort {
  std::string name;
  const MessageType* type = nullptr;
  bool input = false;  ///< a command that the device takes; always optional
  std::string doc;
};

struct DeviceDriver {
  std::string name, doc;
  std::vector<DeviceSetting> settings;
};

struct DeviceKindEntry {
  std::string name, doc;
  std::vector<DevicePort> ports;
  std::vector<DeviceSetting> settings;  ///< that all drivers of the kind take
  std::vector<DeviceDriver> drivers;
};

struct DeviceCatalogue {
  std::map<std::string, DeviceKindEntry> kinds;
};

/// As takt::graph::load, with the devices given.
Loaded load(const std::filesystem::path& file, const LoadOptions& options, const NodeTypes& types,
            const DeviceCatalogue& devices);

/// The devices of a registry, as the loader sees them.
DeviceCatalogue catalogue(const hal::DeviceTypes& types);

}  // namespace takt::graph
