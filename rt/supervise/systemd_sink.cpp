// SPDX-License-Identifier: Apache-2.0
#include "rt/supervise/systemd_sink.hpp"

#include <systemd/sd-daemon.h>

#include <cstdlib>

namespace takt {
namespace {

class SystemdSink final : public WatchdogSink {
 public:
  SystemdSink() {
    uint64_t timeout_us = 0;
    if (sd_watchdog_enabled(0, &timeout_us) > 0) timeout_ns_ = static_cast<int64_t>(timeout_us) * 1000;
  }
  int64_t timeout_ns() const override { return timeout_ns_; }
  void ready() override { notify("READY=1"); }
  void feed() override { notify("WATCHDOG=1"); }
  void status(const std::string& text) override { notify("STATUS=" + text); }
  void end() override { notify("STOPPING=1"); }

 private:
  // A notification that does not get through is one that systemd misses: it acts then, as it should.
  static void notify(const std::string& state) { static_cast<void>(sd_notify(0, state.c_str())); }
  int64_t timeout_ns_ = 0;
};

}  // namespace

std::unique_ptr<WatchdogSink> systemd_sink() {
  if (std::getenv("NOTIFY_SOCKET") == nullptr) return nullptr;
  return std::make_unique<SystemdSink>();
}

}  // namespace takt
