// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <atomic>
#include <cstdint>
#include <limits>

namespace takt {

/// The end of a run as an instant: releases at or after it do not happen. It only ever moves earlier. All calls are
/// async-signal-safe and thread-safe.
class StopSignal {
 public:
  void set_planned_end(int64_t end_ns) { lower(end_ns); }
  /// Ends the run at `now_ns` (or earlier, if an earlier end is set). Sleepers notice within kReaction_ns.
  void raise(int64_t now_ns);
  int64_t end_ns() const { return end_.load(std::memory_order_acquire); }
  /// Sleeps until `instant_ns` of CLOCK_MONOTONIC; returns early once the stop is raised.
  void sleep_until(int64_t instant_ns) const;

  static constexpr int64_t kReaction_ns = 250'000'000;

 private:
  void lower(int64_t end_ns);
  std::atomic<int64_t> end_{std::numeric_limits<int64_t>::max()};
  std::atomic<bool> raised_{false};
};

}  // namespace takt
