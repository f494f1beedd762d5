// SPDX-License-Identifier: Apache-2.0
// Earliest deadline first on one core. `tasks` share the core; answers are in their order. Ties of deadlines may be
// broken in any way: every bound holds for all, and exact means attained under some.
#pragma once
#include "rt/sched/analysis/per_core.hpp"

namespace takt::analysis {

/// Preemptive EDF: does every job meet its deadline? By processor demand: in no interval [s, d] may the jobs that
/// become ready at or after s and are due by d need more than d - s, less the blocking of the task that is due at d.
///
/// Exact for any mix of tasks with offsets and sporadic tasks, with jitter and blocking; only where the hyperperiod of
/// the tasks with offsets exceeds kLongest or holds more than a million releases, or the effort is used up, are offsets
/// forgotten: then a failure is `not_proven`.
///
/// Sources: Baruah, Rosier & Howell 1990 (demand, with offsets), Spuri 1996 (jitter, blocking), Zhang & Burns 2009
/// (QPA: go down from the end of the busy interval; where the demand h(t) is below t, nothing in [h(t), t) can fail).
///
/// Why few s suffice: let [s, d] fail. Move both, the sporadic arrivals and the delayed jobs to the right until s is
/// the latest ready instant (release + jitter) of a job with offset: no job drops out of the interval, so it fails
/// still. One hyperperiod of such s is enough, later ones repeat and earlier ones have no more jobs; for each, d up to
/// where the busy interval from s ends (what fails beyond fails as well from a later s). Conversely a failing [s, d] is
/// a legal pattern of arrivals with a miss in it. Where tasks with offsets have unequal blocking, d may not move; then
/// the responses decide.
DemandAnswer edf_demand_test(const std::vector<TimedTask>& tasks);

/// Preemptive EDF: worst responses. Exact in the same sense and with the same fall-back as the demand test.
///
/// Source: Spuri 1996 (deadline busy periods), carried over to offsets: the job planned at p, due at d, waits for jobs
/// due by d in the interval from the last instant s before which none such was pending.
/// - A job with offset: p is one of a hyperperiod's, d is fixed; s moves to the right until it is the latest ready
///   instant of a job with offset, or a sporadic task's last job that is due by d is due at d itself.
/// - A sporadic job: s, p and d move to the right together until s is the latest ready instant of a job with offset;
///   then p moves to the left until d is the deadline of another job, or an earlier own job arrives with s.
/// No job leaves the interval in these moves, so that the response grows or stays.
ResponseBounds edf_responses(const std::vector<TimedTask>& tasks);

/// The same of the first `work` of the jobs of one task, 0 < work <= budget, from their planned releases: its jobs before
/// count whole. Nothing beyond the range.
std::optional<Ticks> edf_response_of_first(const std::vector<TimedTask>& tasks, size_t task, Ticks work);

/// Non-preemptive EDF (policy `cooperative`): does every job meet its deadline? Time is whole ticks: a job that blocks
/// has started one tick before the interval at the latest.
///
/// Exact without offsets, i.e. for sporadic tasks, with jitter (ready in the order of release) and for all execution
/// times up to the budgets: Jeffay, Stanat & Martel 1991; George, Rivierre & Spuri 1996, whose condition is h(t) +
/// max(budget - 1 of tasks with deadline - jitter > t) <= t. A single task with an offset is as good as sporadic.
///
/// Sufficient with offsets (the exact question is NP-hard in the strong sense, Jeffay et al.): the demand of the
/// preemptive test for its s, and in front of it one job with an offset that could have started before s and is due
/// after d. That both happen at once is not shown; a failure is then `not_proven`.
DemandAnswer non_preemptive_edf_demand_test(const std::vector<TimedTask>& tasks);

/// Non-preemptive EDF: worst responses. Exact without offsets (George, Rivierre & Spuri 1996), bounds with them.
ResponseBounds non_preemptive_edf_responses(const std::vector<TimedTask>& tasks);

}  // namespace takt::analysis
