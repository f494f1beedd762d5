// SPDX-License-Identifier: Apache-2.0
#include "graph/run/watchdog.hpp"

#include <pthread.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "rt/capability.hpp"
#include "rt/supervise/systemd_sink.hpp"
#include "rt/supervise/watchdog_device.hpp"
#include "rt/time/clock.hpp"

namespace takt::command {
namespace {

constexpr int64_t kLongestTick_ns = 100'000'000;
constexpr int64_t kTicksPerFeed = 8;  // a feed is late by an eighth of half a timeout at most

}  // namespace

RunWatchdog::RunWatchdog(const RunOptions& options, const Plan& plan, RunBoard& board) {
  if (options.clock == "virtual") return;
  if (auto systemd = systemd_sink()) sinks_.push_back(std::move(systemd));
  if (!options.watchdog.empty())
    sinks_.push_back(
        std::make_unique<WatchdogDevice>(options.watchdog, options.watchdog_timeout_s, kernel_watchdog_port()));
  if (sinks_.empty()) return;
  std::vector<WatchdogSink*> sinks;
  for (const auto& sink : sinks_) sinks.push_back(sink.get());
  outward_ = std::make_unique<OutwardWatchdog>(plan, board, std::move(sinks));
}

RunWatchdog::~RunWatchdog() { join(); }

void RunWatchdog::tick(int64_t now_ns) {
  if (outward_) outward_->tick(now_ns);
}

int64_t RunWatchdog::tick_interval_ns() const {
  const int64_t feeds_ns = outward_ ? outward_->interval_ns() : 0;
  return feeds_ns > 0 ? std::clamp<int64_t>(feeds_ns / kTicksPerFeed, 1'000'000, kLongestTick_ns) : kLongestTick_ns;
}

void RunWatchdog::start() {
  if (outward_) thread_ = OwnThread([this] { loop(); });
}

void RunWatchdog::loop() {
  pthread_setname_np(pthread_self(), "watchdog-out");
  keep_rights(Rights::none);
  const MonotonicClock clock;
  while (!ended_.load()) {
    tick(clock.now_ns());
    std::this_thread::sleep_for(std::chrono::nanoseconds(tick_interval_ns()));
  }
}

void RunWatchdog::join() {
  ended_.store(true);
  if (thread_.joinable()) thread_.join();
}

void RunWatchdog::end() {
  join();
  if (outward_) outward_->end();
}

}  // namespace takt::command
