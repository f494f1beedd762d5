// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/hal/driver_parts.hpp>: hal, experimental.
// What drivers' own registrations have in common.
#pragma once
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "hal/devices.hpp"
#include "hal/settings/failures.hpp"
#include "rt/time/rate.hpp"

namespace takt::hal {

/// The setting `rate`; 15 Hz.
Rate rate_of(Settings& settings);
/// "estop, 5": the parts between the commas.
std::vector<std::string> list_of(Settings& settings, const std::string& name, const std::string& fallback);
/// The setting `interface` of a CAN device.
std::string interface_of(Settings& settings);
/// A time of at most so long, both in s.
int64_t time_ns(Settings& settings, const char* name, double fallback_s, double most_s);

/// The device behind one that fails as the setting `failures` and `takt fault` say.
template <class Failing, class Interface, class... More>
std::unique_ptr<Interface> with_failures(std::unique_ptr<Interface> device, Settings& settings, More&&... more) {
  auto windows = parse_failures(settings.text("failures", ""));
  if (!windows) settings.fail("`failures`: " + windows.error(), "correct `failures`");
  if (!windows) return device;
  return std::make_unique<Failing>(std::move(device), FailureSchedule(std::move(*windows)),
                                   std::forward<More>(more)...);
}

/// The node of a device that is still closed.
template <class NodeClass, class Interface, class... More>
NodeResult closed(std::unique_ptr<Interface> device, const Settings& settings, More&&... more) {
  if (settings.error()) return tl::unexpected(*settings.error());
  return std::make_unique<NodeClass>(std::move(device), std::forward<More>(more)...);
}

template <class NodeClass, class Interface, class... More>
NodeResult opened(std::unique_ptr<Interface> device, const Settings& settings, More&&... more) {
  NodeResult node = closed<NodeClass>(std::move(device), settings, std::forward<More>(more)...);
  if (!node) return node;
  if (const auto result = (*node)->device().open(); !result) return tl::unexpected(result.error());
  return node;
}

}  // namespace takt::hal
