// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <memory>
#include <stdexcept>

#include "rt/supervise/outward_watchdog.hpp"

namespace takt {

/// What the kernel offers for a watchdog device (linux/watchdog.h); a test brings a double. Calls return 0 or an errno.
class WatchdogPort {
 public:
  virtual ~WatchdogPort() = default;
  /// From here on the machine is reset unless somebody keeps it alive.
  virtual int open(const std::filesystem::path& file) = 0;
  /// Asks for a timeout; the one that the device took instead is written back.
  virtual int set_timeout(int& seconds) = 0;
  virtual int keep_alive() = 0;
  /// The magic letter that disarms the device when it is closed afterwards.
  virtual int write_magic_close() = 0;
  virtual void close() = 0;
};

std::unique_ptr<WatchdogPort> kernel_watchdog_port();

/// Says which file, why, and what to do.
struct WatchdogRefused : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A watchdog of the machine such as /dev/watchdog: it resets the machine unless it is fed in time. end() disarms it;
/// an object that goes without end() leaves it armed.
class WatchdogDevice final : public WatchdogSink {
 public:
  /// Opens and arms it; timeout_s >= 1. Throws WatchdogRefused.
  WatchdogDevice(const std::filesystem::path& file, int timeout_s, std::unique_ptr<WatchdogPort> port);
  ~WatchdogDevice() override;
  int64_t timeout_ns() const override { return timeout_ns_; }
  void ready() override {}
  void feed() override { static_cast<void>(port_->keep_alive()); }
  void status(const std::string&) override {}
  void end() override;

 private:
  std::unique_ptr<WatchdogPort> port_;
  int64_t timeout_ns_ = 0;
  bool open_ = true;
};

}  // namespace takt
