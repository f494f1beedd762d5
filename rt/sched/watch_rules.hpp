// SPDX-License-Identifier: Apache-2.0
// What the watchdog decides, as plain arithmetic: no thread, no clock.
#pragma once
#include <cstdint>

#include "rt/sched/plan.hpp"

namespace takt {

/// What is to happen to the jobs of one task while they run. Times in ns.
struct WatchRules {
  int64_t budget_ns = 0;    ///< CPU time of a job; > 0
  int64_t deadline_ns = 0;  ///< relative to the release
  int64_t patience_ns = 0;  ///< a job that has not returned this long after its deadline hangs
  bool demote = false;      ///< budget used up: it goes on with what the others leave
  bool stop_on_overrun = false, stop_on_miss = false;  ///< on_overrun, on_miss: safe_stop
  bool lift = false;  ///< late through what the host took, or its reservation used up: it goes on beside that
  bool low = false;   ///< once its reservation is used up: behind all workers, and while it is in time

  bool minds_overrun() const { return demote || stop_on_overrun; }
};

/// Rules of a task under the policy that was granted. The kernel itself enforces budgets under `deadline`.
WatchRules watch_rules(const TaskPlan& task, Policy granted, int64_t patience_ns);

/// What is enforced where no budget is stated: a quarter of the deadline, as it is reserved.
int64_t enforced_budget_ns(const TaskPlan& task);

/// One worker as the watchdog sees it at an instant.
struct WatchSight {
  int64_t now_ns = 0;
  bool running = false;
  int64_t release_ns = 0;                                           ///< of the job that runs; else of the next one
  int64_t cpu_left_ns = 0;                                          ///< running: until the budget is used up
  bool overrun_told = false, miss_told = false, hang_told = false;  ///< of this job already
  int64_t stolen_ns = 0;  ///< what the host took lately; cpu_left_ns must be told of a job that is late then, or lifted
  int64_t owed_ns = 0;    ///< by how much jobs of the worker overran lately, this one apart
  bool lifted = false;    ///< the worker is, still
  bool first = false;     ///< lifted before all workers
  bool ordinary = false;  ///< as an ordinary thread
  bool stands = false;    ///< its CPU clock has not moved since the look before
};

struct WatchVerdict {
  bool overrun = false, miss = false, hang = false, lift = false, drop = false;  ///< to be acted on now
  int64_t look_again_ns = 0;                                                     ///< nothing can happen before
};

/// Both of the following at once: for a watchdog that nothing keeps from looking.
WatchVerdict judge(const WatchRules& rules, const WatchSight& sight);

/// The budget. A job cannot have used a budget before that much time has passed: the next look is due when that can
/// have happened. A job that runs, or is late to begin, is looked at no more than once in kWatchGrain_ns: that is the
/// enforcement error, in addition to the watchdog's own wake-up. While its clock stands still (throttled, preempted),
/// no more than once in kStandsGrain_ns.
WatchVerdict judge_budget(const WatchRules& rules, const WatchSight& sight);

/// What goes by the clock: a miss, a hang; and under `deadline` what the host took.
///
/// The kernel charges a reservation for time that the host took from its CPU, and holds the thread back until that is
/// paid off, one budget a period: a job that is late while its worker owes something, and no more than the host took,
/// is lifted out of that, and dropped to be an ordinary thread once it has used more than that. One that was lifted
/// because its reservation was used up (see judge_reserve) may use as much as its deadline is long, one of low
/// criticality half a budget. All of that is seen when somebody looks: it makes no look_again.
WatchVerdict judge_clock(const WatchRules& rules, const WatchSight& sight);

constexpr int64_t kWatchGrain_ns = 100'000, kStandsGrain_ns = 1'000'000;

/// Between two signs of life of a process that somebody outside looks after.
constexpr int64_t kHeartbeat_ns = 200'000'000;

/// Looks of a lane's own watchdog (see Watchdog) at one job, if the lane is preempted `preemptions` times meanwhile,
/// and besides for `short_ns` in many short pieces. The watchdog runs only when the lane could. One look may come
/// before the job has begun, one when the budget could be used up, one within the last grain, and one for what looks
/// themselves take. Each other one finds that the lane was preempted since the one before, which is at least a grain
/// ago: short pieces must take half of that to make another look necessary.
constexpr int64_t most_looks(int64_t preemptions, int64_t short_ns) {
  return 4 + preemptions + (2 * short_ns + kWatchGrain_ns - 1) / kWatchGrain_ns;
}

/// The kernel's account is not ours: it begins and ends in the middle of what a worker does around its sleep.
constexpr int64_t kReserveSlack_ns = 100'000;

/// What a worker has left of its reservation. Times in ns.
struct ReserveSight {
  int64_t now_ns = 0;
  int64_t release_ns = 0;   ///< of the job that runs; else of the next one
  int64_t deadline_ns = 0;  ///< of that job
  int64_t runtime_ns = 0;   ///< of the reservation
  int64_t left_ns = 0;      ///< of it; must be told from release + runtime on
  int64_t owed_ns = 0;      ///< by how much jobs of the worker overran lately, this one apart
  int64_t period_ns = 0;    ///< of the reservation
  int64_t stood_ns = 0;     ///< of the time since the release: watched without a break, and nothing was used
  bool stands = false;      ///< used_up() at the look before, and nothing was used since
  bool lifted = false;
  bool low = false;  ///< nobody of high criticality is on it

  bool used_up() const { return left_ns <= kReserveSlack_ns; }
};

struct ReserveVerdict {
  bool lift = false;
  bool rescue = false;  ///< the kernel has forgotten it
  int64_t look_again_ns = 0;
};

/// A worker may have used up what it has before its job has even begun: where the host takes a CPU without saying so,
/// the kernel charges whoever was on it. One that has, and is not served any more, is to be lifted. While others leave
/// it something beyond its reservation (Reservation::reclaims) it goes on there. One that would be dropped at once for
/// what it owes is not lifted, and no late one of low criticality: its reservation is due again. Nothing can be
/// used up before that much time has passed since the release: a job that is done by then costs one look.
///
/// Linux 6.18 now and then forgets a thread that was lifted, has its reservation back, sleeps and wakes: it stays
/// runnable and is never run (measured with tests/endurance/lifts.cpp: after 8 to 1,000 lifts). One that has not run
/// for four periods and kForgotten_ns, whatever it owes, is rescued.
ReserveVerdict judge_reserve(const ReserveSight& sight);

constexpr int64_t kReserveGrain_ns = 1'000'000, kForgotten_ns = 200'000'000;
/// Between two looks at a reservation where nothing can be done soon.
constexpr int64_t kReserveRest_ns = 50'000'000;

}  // namespace takt
