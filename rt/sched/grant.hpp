// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "rt/sched/plan.hpp"

namespace takt {

/// The highest SCHED_FIFO priority that lanes and their watchdogs have. Below the kernel's own interrupt threads (50
/// by default) nothing is gained.
inline constexpr int kHighestPriority = 80;
/// Behind all lanes and before ordinary threads.
inline constexpr int kLowestPriority = 1;
/// Under `fixed` a lane has every other priority, and its own watchdog the one above: 79 and 80 down to 3 and 4.
inline constexpr int kLaneStep = 2;
inline constexpr int kMostLanesOfCore = (kHighestPriority - kLowestPriority) / kLaneStep;

/// What a worker thread asks of the kernel.
struct Reservation {
  Policy policy = Policy::cooperative;
  int64_t runtime_ns = 0, deadline_ns = 0, period_ns = 0;  ///< deadline
  int priority = 0;                                        ///< fixed: SCHED_FIFO 1..99
  int core = -1;                                           ///< fixed: the only CPU; -1: any
  /// cooperative: how long a turn beside other ordinary threads is to last, 0.1 to 100 ms; 0: as the kernel likes. One
  /// that asks for a short one is let in first when it wakes up (EEVDF, Linux 6.12 on; older kernels ignore it).
  int64_t slice_ns = 0;
  /// deadline: once its runtime is used up the thread goes on with what other reservations leave unused
  /// (SCHED_FLAG_RECLAIM, the kernel's GRUB: Lipari & Baruah 2000; Abeni, Lipari, Parri & Sun 2016). Without it a
  /// thread that the host of a virtual machine stops for longer than its runtime is held back for a period or more.
  bool reclaims = false;
};

/// What the kernel says the thread has, read back after asking.
struct Grant {
  Policy policy = Policy::cooperative;
  double runtime_ms = 0, deadline_ms = 0;
  int priority = 0;
  std::vector<int> cpus;
  bool verified = false;  ///< read back and equal to what was asked
  int error = 0;          ///< errno of what was refused; 0: nothing was
  std::string refused;    ///< empty, or what was refused and the fix
};

/// What a worker under `cooperative` asks for: the shortest turns there are. Measured beside a hog on each of two CPUs,
/// p99 of releases: 0.67 ms, with turns of 0.5 ms 2.0 ms, as the kernel chooses them (1.4 ms) 2.7 ms.
Reservation cooperative_reservation();

/// SCHED_FIFO of that priority, 1..99. `core`: the only CPU; -1: any.
Reservation fixed_reservation(int priority, int core = -1);

/// SCHED_DEADLINE parameters for a lane of that budget, deadline and period. The reservation period is the deadline, or
/// 0.95 of the period where they are equal: a longer one is replenished on a grid of its own and throttles releases
/// that fall before it (measured: up to 27 ms late).
Reservation deadline_reservation(int64_t budget_ns, int64_t deadline_ns, int64_t period_ns);

/// A thread of SCHED_DEADLINE that ends gives its bandwidth back at its 0-lag time, at most one period of its
/// reservation later; whoever wants it asks again every kBandwidthStep_ns.
inline constexpr int64_t kBandwidthStep_ns = 5'000'000, kBandwidthMargin_ns = 100'000'000;
/// When the bandwidth of threads with these reservations is there again at the latest after all of them have ended; 0
/// if none is of `deadline`.
int64_t bandwidth_within_ns(const std::vector<Reservation>& reservations);

/// Applies the reservation to the calling thread and reads it back. Waits up to `patience_ns` for bandwidth.
Grant apply(const Reservation& reservation, int64_t patience_ns = kBandwidthMargin_ns);

/// What a thread of this process has (0: the calling one), beside what it wanted.
Grant read_back(const Reservation& wanted, int thread = 0);

/// Puts a thread of this process (0: the calling one) behind all real-time ones (SCHED_OTHER), where it gets its share
/// beside whatever else the machine does: behind that as well (SCHED_IDLE) a job could last for minutes, and so could
/// the end of its process. False if the kernel refuses.
bool demote_thread(int thread);
/// Lets another thread of this process run before all of the default policy (SCHED_FIFO of that priority). False if the
/// kernel refuses.
bool lift_thread(int thread, int priority);
/// Puts a thread of SCHED_DEADLINE that is runnable, of this process or another one, at kLowestPriority. False if it is
/// not such a one, or the kernel refuses.
bool take_from_reservation(int thread);
/// A thread runs, or would but for its turn or its reservation. Only such a one may be taken out of
/// SCHED_DEADLINE: where it sleeps, Linux 6.18 never gives its bandwidth back (until sched_rt_runtime_us is written).
/// One that is put back by others, or whose parameters they change while it is throttled, may never be replenished
/// again: not even SIGKILL ends it then. All measured.
bool runnable(int thread);
/// What a thread of any process has of SCHED_DEADLINE; nothing if it is under another policy, or takes no part in its
/// account (the kernel's own for cpufreq).
std::optional<Reservation> reservation_of(int thread);
/// Gives the calling thread back what it had under `fixed` or `deadline`. False if the kernel refuses.
bool restore_thread(const Reservation& had);

/// Puts the calling thread back to the default policy on all CPUs.
void apply_default();

}  // namespace takt
