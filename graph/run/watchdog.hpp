// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <atomic>
#include <memory>
#include <vector>

#include "graph/run/run.hpp"
#include "rt/own_thread.hpp"
#include "rt/supervise/outward_watchdog.hpp"

namespace takt::command {

/// Who outside is told that a run is well: systemd if it started this process, and the device of --watchdog. A run in
/// one process starts a thread for it; a supervisor that loops anyway calls tick(). In virtual time nobody is told.
/// An object that goes without end() leaves the watchdogs to bite.
class RunWatchdog {
 public:
  /// Opens the device. Throws WatchdogRefused. Plan and board outlive it.
  RunWatchdog(const RunOptions& options, const Plan& plan, RunBoard& board);
  ~RunWatchdog();
  RunWatchdog(const RunWatchdog&) = delete;
  RunWatchdog& operator=(const RunWatchdog&) = delete;

  /// From a loop that comes round at least every tick_interval_ns(); does not wait. Not beside start().
  void tick(int64_t now_ns);
  /// At most 100 ms; ns.
  int64_t tick_interval_ns() const;
  /// Ticks from a thread of its own until the object goes or end() is called.
  void start();
  /// The run is over, and nothing of it goes on that should not.
  void end();

 private:
  void loop();
  void join();

  std::vector<std::unique_ptr<WatchdogSink>> sinks_;
  std::unique_ptr<OutwardWatchdog> outward_;  ///< null: nobody listens
  std::atomic<bool> ended_{false};
  OwnThread thread_;
};

}  // namespace takt::command
