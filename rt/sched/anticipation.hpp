// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>

#include "rt/sched/stop_signal.hpp"
#include "rt/time/clock.hpp"

namespace takt {

/// Brings a worker to its release in time. A thread gets to run some time after the instant it asked to be woken at
/// (timer interrupt, leaving the idle state, the switch), so a worker asks that much earlier and waits the rest of it
/// out awake. Its lead follows what its wake-ups took: about four of five are to be there in time. The CPU time that
/// this costs a release is bounded by `longest_ns`. One thread.
class Anticipation {
 public:
  /// Who else gets the CPU while a worker is awake: only more urgent workers, or, without a real-time policy, whatever
  /// computes on this machine, and then for the length of a time slice.
  enum class Beside : uint8_t { workers, everybody };
  /// `longest_ns`: bound of the lead; 0: the worker sleeps until the release itself. Beside everybody the lead begins
  /// at 0, and a worker that lost the CPU awake sleeps until the release itself for a while, longer each time.
  Anticipation(int64_t longest_ns, Beside beside)
      : longest_ns_(longest_ns), beside_(beside), lead_ns_(beside == Beside::workers ? longest_ns : 0) {}
  /// Sleeps until the lead before `release_ns` of CLOCK_MONOTONIC, or until the stop. True if it then is still before
  /// the release, and at most longest_ns before it: what is left is to be waited out.
  bool sleep_before(int64_t release_ns, const Clock& clock, const StopSignal& stop);
  /// Returns at `release_ns`. The CPU time of the thread up to then is no job's.
  void stay_awake_until(int64_t release_ns, const Clock& clock);

  int64_t lead_ns() const { return lead_ns_; }
  /// A wake-up came this long after the instant asked for.
  void learn(int64_t took_ns);

  static constexpr int64_t kStep_ns = 2'000;
  static constexpr int64_t kLostCpu_ns = 300'000;                ///< between two looks at the clock while awake
  static constexpr int kShortestRest = 64, kLongestRest = 1024;  ///< releases

 private:
  const int64_t longest_ns_;
  const Beside beside_;
  int64_t lead_ns_;
  int rest_ = 0, next_rest_ = kShortestRest;
};

}  // namespace takt
