// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/hal/device_double.hpp>: hal, experimental.
#pragma once
#include <cstdint>
#include <span>

#include "hal/device.hpp"
#include "hal/misbehaviour.hpp"

namespace takt {

/// Stands in for a device at the far end of its line: the device's bytes, at the device's times. It has no thread and
/// no clock of its own: what happens until an instant is done by run_to(). One thread at a time.
class DeviceDouble {
 public:
  DeviceDouble() = default;
  DeviceDouble(const DeviceDouble&) = delete;
  DeviceDouble& operator=(const DeviceDouble&) = delete;
  virtual ~DeviceDouble() = default;

  /// Before the first run_to(): makes the line, or makes it anew.
  virtual DeviceResult plug_in() = 0;
  /// Does what is due until that instant; instants never go back. Bytes of the host count as arrived now.
  virtual void run_to(int64_t now_ns) = 0;
  /// How often run_to() is to be called: what happens at the device is seen so late at most.
  virtual int64_t step_ns() const { return 1'000'000; }
  /// What it can be told to do, `none` among them.
  virtual std::span<const Misbehaviour> known() const = 0;
  /// From now on, until another one is given; one of known(), others change nothing.
  virtual void misbehave(Misbehaviour how) = 0;
};

}  // namespace takt
