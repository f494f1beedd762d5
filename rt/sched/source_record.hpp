// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <atomic>
#include <cstdint>
#include <utility>

#include "rt/hot.hpp"
#include "rt/sched/append_log.hpp"
#include "rt/source_state.hpp"

namespace takt {

/// How the source of a task stands: what it reads from outside the run (of a hardware node, its device). Written by the
/// thread that runs the task, and by the supervisor once the task's process is dead; anybody reads at any time.
struct alignas(kCacheLine) SourceRecord {
  std::atomic<SourceState> state{SourceState::ok};
  std::atomic<int64_t> since_ns{0};       ///< when it came into that state; 0: it was never in another
  std::atomic<int64_t> lost_since_ns{0};  ///< beginning of the loss that goes on; of no meaning while ok
  std::atomic<int64_t> lost_ns{0};        ///< sum of the losses that are over
  std::atomic<uint64_t> losses{0};        ///< changes from ok to any other state
  std::atomic<uint64_t> reopen_tries{0};
  std::atomic<uint64_t> received{0}, damaged{0}, resyncs{0}, missing{0}, unsent{0};  ///< see SourceCounts
  BoundedText<96> trouble;                                                           ///< SourceReport::trouble

  void tell(const SourceReport& report) {
    const auto keep = [](auto& to, auto value) { to.store(value, std::memory_order_relaxed); };
    keep(reopen_tries, report.reopen_tries);
    keep(received, report.counts.received);
    keep(damaged, report.counts.damaged);
    keep(resyncs, report.counts.resyncs);
    keep(missing, report.counts.missing);
    keep(unsent, report.counts.unsent);
    // Copied only when it is another one: these are literals of the driver, and a pointer means nothing to others.
    if (std::exchange(told_, report.trouble) != report.trouble) trouble = BoundedText<96>(report.trouble);
  }
  SourceCounts counts() const {
    return {received.load(), damaged.load(), resyncs.load(), missing.load(), unsent.load()};
  }

  /// All of its losses up to `now_ns`.
  int64_t lost_until_ns(int64_t now_ns) const {
    const int64_t over = lost_ns.load(std::memory_order_relaxed);
    if (state.load(std::memory_order_acquire) == SourceState::ok) return over;
    const int64_t going_on = now_ns - lost_since_ns.load(std::memory_order_relaxed);
    return over + (going_on > 0 ? going_on : 0);
  }

 private:
  const char* told_ = nullptr;
};

}  // namespace takt
