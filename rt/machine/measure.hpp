// SPDX-License-Identifier: Apache-2.0
// What this machine costs a schedule, measured by doing it: the analyses of `takt check` charge these figures. Each
// measurement runs in a forked process with locked memory and gives nothing where these rights do not allow it. The
// calling process must have one thread. About 20 s in all.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "rt/machine/spread.hpp"
#include "rt/sched/plan.hpp"

namespace takt::machine {

/// Wake-ups from clock_nanosleep at planned instants: four threads at 40 Hz, out of step, on an otherwise idle program.
struct ReleaseCost {
  Policy policy = Policy::cooperative;  ///< the best that was granted
  Spread lateness;
};
std::optional<ReleaseCost> measure_release();

/// One of two threads on one CPU wakes the other and sleeps: half of a round trip over a futex, one switch each.
struct SwitchCost {
  bool fixed = false;  ///< SCHED_FIFO was granted
  Spread one_way;
};
std::optional<SwitchCost> measure_switch();

/// Publishing is loan and publish, taking is list, take and release; nothing is written into the message.
struct TransferCost {
  uint64_t bytes = 0;
  Spread publish, take;
};
inline constexpr std::array<uint64_t, 3> kTransferBytes{128, 921'600, 3'686'400};  // a word, 640x480, 1280x960 BGR
using TransferCosts = std::array<TransferCost, kTransferBytes.size()>;
std::optional<TransferCosts> measure_local_transfers();
/// Nothing where no iceoryx daemon can be started.
std::optional<TransferCosts> measure_iceoryx_transfers();

/// By how much a thread that spins exceeds its budget before it is stopped.
inline constexpr int64_t kEnforcedBudget_ns = 1'000'000;
/// SCHED_DEADLINE: a reservation of 1 ms every 10 ms, full at the start of each sample.
std::optional<Spread> measure_reservation_overrun();
/// SCHED_FIFO: a watchdog that sleeps on CLOCK_MONOTONIC, reads the thread's CPU clock, and has demoted it.
std::optional<Spread> measure_watchdog_overrun();
/// What one look of that watchdog takes from the thread: its timer's interrupt, two switches, the look.
std::optional<Spread> measure_watchdog_look();
/// A timer on the thread's own CPU clock; needs no rights.
std::optional<Spread> measure_cpu_timer_overrun();

/// Least distance of two steps of CLOCK_MONOTONIC_COARSE, us.
std::optional<double> measure_tick();

/// Sum of runtime / period that the kernel still accepts in SCHED_DEADLINE reservations, found by making them.
struct BandwidthLimit {
  double accepted = 0;  ///< cores
  int64_t others = 0;   ///< threads that held a reservation beforehand; theirs is not part of `accepted`
};
std::optional<BandwidthLimit> measure_deadline_bandwidth();

/// Holes in the time of threads that spin on one CPU after the other.
struct Stalls {
  static constexpr int64_t kShortest_ns = 20'000;
  int64_t observed_ns = 0;
  int64_t count = 0, over_1ms = 0, sum_ns = 0, max_ns = 0;  ///< nobody else was scheduled: the host, or an interrupt
  int64_t preempted = 0, preempted_max_ns = 0;              ///< another thread of this machine ran
  int64_t stolen_ns = 0;                                    ///< what /proc/stat says for the same time
  /// A hole between two readings of the clock.
  void add(int64_t hole_ns, bool was_preempted);
};
std::optional<Stalls> measure_stalls();

struct Measured {
  std::optional<ReleaseCost> release;
  std::optional<SwitchCost> context_switch;
  std::optional<TransferCosts> local, iceoryx;
  std::optional<Spread> reservation_overrun, watchdog_overrun, watchdog_look, cpu_timer_overrun;
  std::optional<double> tick_us;
  std::optional<BandwidthLimit> bandwidth;
  std::optional<Stalls> stalls;
};
/// All of them, one after the other; `tell` is called with the name of each before it begins.
Measured measure_all(const std::function<void(const std::string&)>& tell);

/// Largest value in [low, high] that `accepts`, to `step`; low must be accepted.
int64_t bisect_largest(int64_t low, int64_t high, int64_t step, const std::function<bool(int64_t)>& accepts);

}  // namespace takt::machine
