// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <doctest/doctest.h>

#include <string>

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
  Double device{interface, clock};
  Driver driver;

  /// `settings`: all but the interface.
  template <class Settings>
  explicit CanBench(Settings settings) : driver("device", on(std::move(settings), interface), clock) {
    REQUIRE(device.open(clock.now_ns()) == 0);
  }
  void pace(int64_t at_ns) {
    clock.advance_to(at_ns);
    device.run_until(at_ns);
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
