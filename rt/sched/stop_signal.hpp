// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "rt/hot.hpp"

namespace takt {

/// What one process says of the end of a run, in pages that only this process can write to. The instant carries a
/// check, so that a stray store of that process is no stop.
struct alignas(kCacheLine) StopWord {
  std::atomic<uint64_t> asked{0};  ///< microseconds of the clock, 48 bits, above 16 bits of check; 0: none
  std::atomic<int64_t> planned_end_ns{std::numeric_limits<int64_t>::max()};  ///< said by the first process only
};

/// The end of a run as an instant, the earliest that any process asks for: releases at or after it do not happen. It
/// only ever moves earlier. All calls but speak_as() are async-signal-safe and thread-safe.
///
///   StopSignal stop;                                 // of this process alone
///   StopSignal shared({&supervisor, &member});       // words in shared memory; speaks as the first of them
class StopSignal {
 public:
  StopSignal() : words_{&alone_} {}
  /// At least one; they outlive the signal.
  explicit StopSignal(std::vector<StopWord*> words) : words_(std::move(words)) {}
  StopSignal(const StopSignal&) = delete;
  StopSignal& operator=(const StopSignal&) = delete;

  /// From here on this process is that one of the words. Before there is a second thread.
  void speak_as(size_t word) { own_ = word; }
  /// Of the first word; others leave it to that.
  void set_planned_end(int64_t end_ns);
  /// Ends the run at `now_ns`, rounded down to a microsecond (or earlier, if an earlier end is set). Sleepers notice
  /// within kReaction_ns.
  void raise(int64_t now_ns);
  int64_t end_ns() const;
  /// Sleeps until `instant_ns` of CLOCK_MONOTONIC; returns early once the stop is raised.
  void sleep_until(int64_t instant_ns) const;

  static constexpr int64_t kReaction_ns = 250'000'000;

 private:
  /// The earliest that anybody asks for; the largest number if nobody does.
  int64_t asked_ns() const;

  StopWord alone_;
  std::vector<StopWord*> words_;
  size_t own_ = 0;
};

}  // namespace takt
