// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/hal/settings/settings.hpp>: hal, experimental.
#pragma once
#include <filesystem>
#include <optional>
#include <string>

#include "hal/device.hpp"
#include "hal/settings/json.hpp"
#include "hal/settings/units.hpp"
#include "rt/msg/geometry.hpp"

namespace takt {

/// Typed access to a device's settings. The first thing that is wrong is kept in `error()`; later reads go on with
/// defaults, so that a driver reads everything and then asks once.
class Settings {
 public:
  Settings(std::string device_id, const nlohmann::json& values, std::filesystem::path directory)
      : id_(std::move(device_id)), values_(values), directory_(std::move(directory)) {}

  const std::string& id() const { return id_; }
  bool has(const std::string& name) const { return values_.is_object() && values_.contains(name); }
  /// A number in SI, or a text with its unit ("0.24m").
  double quantity(const std::string& name, Dimension dimension, double fallback);
  /// As quantity, but an error if it is missing.
  double quantity(const std::string& name, Dimension dimension);
  int64_t count(const std::string& name, int64_t fallback, int64_t low, int64_t high);
  bool flag(const std::string& name, bool fallback);
  std::string text(const std::string& name, const std::string& fallback);
  /// Relative paths start at the graph file's directory; empty if missing and not required.
  std::filesystem::path path(const std::string& name, bool required);
  Transform mount(const std::string& name);

  void fail(std::string what, std::string fix);
  const std::optional<DeviceError>& error() const { return error_; }

 private:
  std::string id_;
  nlohmann::json values_;
  std::filesystem::path directory_;
  std::optional<DeviceError> error_;
};

}  // namespace takt
