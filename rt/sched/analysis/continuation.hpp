// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "rt/sched/analysis/per_core.hpp"

namespace takt::analysis {

/// Work of a job that its thread begins in the instant in which it has done what comes before it in the same job.
struct Continuation {
  size_t task = 0;
  Ticks work = 0;      ///< at most
  Ticks ready_by = 0;  ///< bound on that instant, from the job's planned release
  Ticks done_by = 0;   ///< bound on its end, from the job's planned release
  Ticks slack = 0;     ///< what the others may come earlier or later than planned without its being charged as jitter
};

/// Bound on the time from that instant to the end of the work, for tasks that share one core and always get ready
/// within their jitter (none that waits in the middle of its job). Nothing beyond the range of the analysis. Pure
/// function; any thread.
///
/// In the instant t in which the thread goes on nothing that comes before it is pending, or it would not run. So only
/// what becomes ready from t on holds it up: the jobs of `BusyStart`; under EDF of these only those that are due no
/// later than the job itself. Move t, and with it sporadic arrivals and delayed jobs, to the right until it is the
/// latest ready instant of a job with offset, or the last instant possible: no job drops out, and each comes no later
/// relative to t. (Sporadic ones could drop out by their deadlines; so as many count as are in time from the release.) No
/// bound is larger than what `done_by` leaves of the earliest t that moves to the same instant.
std::optional<Ticks> continuation_response(const std::vector<TimedTask>& tasks, CorePolicy policy,
                                           const Continuation& piece);

}  // namespace takt::analysis
