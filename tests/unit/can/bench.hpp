// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <doctest/doctest.h>

#include <string>
#include <utility>

#include "rt/time/clock.hpp"
#include "tests/conformance/devices.hpp"
#include "tests/temporary_folder.hpp"

namespace takt::test {

/// A driver and its double, byte by byte through a socket, in virtual time.
template <class Driver, class Double>
struct CanBench {
  TemporaryFolder folder;
  std::string interface = "unix:" + (folder.path / "can").string();
  VirtualClock clock{kDeviceEpoch};
  Double device;
  Driver driver;

  /// `settings`: all but the interface. `of_double`: what the double takes besides.
  template <class Settings, class... More>
  explicit CanBench(Settings settings, More&&... of_double)
      : device(interface, clock, std::forward<More>(of_double)...),
        driver("device", on(std::move(settings), interface), clock) {
    REQUIRE(device.plug_in().has_value());
  }
  void pace(int64_t at_ns) {
    clock.advance_to(at_ns);
    device.run_to(at_ns);
  }
  int64_t now() const { return clock.now_ns(); }

 private:
  template <class Settings>
  static Settings on(Settings settings, const std::string& interface) {
    settings.interface = interface;
    return settings;
  }
};

}  // namespace takt::test
