// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "rt/sched/analysis/per_core.hpp"

namespace takt::analysis {

/// Worst responses under preemptive fixed priorities of tasks that share one core, in the order of `tasks`.
///
/// Exact, for any mix of tasks with offsets (releases at offset + k * period and nowhere else) and sporadic tasks, each
/// with jitter and blocking: every bound is attained. Only where the hyperperiod of the tasks with offsets exceeds
/// kLongest or holds more than a million releases, or the effort of the analysis is used up, are offsets forgotten:
/// then bounds only, `exact` false. Responses above the period included.
///
/// Sources: Joseph & Pandya 1986 and Audsley et al. 1993 (the recurrence; jitter, blocking), Lehoczky 1990 and Tindell,
/// Burns & Wellings 1994 (several jobs in one busy period), Leung & Merrill 1980 (offsets: one hyperperiod after the
/// last first release decides).
///
/// Why it is exact with both kinds mixed. Let a job of task i finish at f, and s be the last instant before which no
/// job of priority >= i was pending: in [s, f) nothing else runs but what blocks i.
/// 1. For a fixed s the worst jobs are those of `BusyStart`: a job of higher priority does most when it is ready as
///    early as possible from s on. Task i itself, if sporadic, has its q-th job finish at the same instant whenever
///    before it arrived in the busy period, so the earliest arrival gives the longest response.
/// 2. s may be taken as the latest ready instant (release + jitter) of a job with offset. Otherwise move s, all
///    sporadic arrivals, and the delayed jobs by d to the right until it is: no job drops out, each comes no later
///    relative to s, so the busy period is no shorter and ends at f + d or later. The response grows or stays.
/// 3. Conversely the jobs of each such s are a legal pattern (older pending work could only add to it), so that what is
///    computed happens. Releases before the last first release add nothing: the same pattern with at least those jobs
///    comes one hyperperiod later.
/// Execution times below the budget shorten every response here, so budgets are the worst.
///
/// Deferrable tasks, as the kernel's fair server: behind all others where that gets each done within its deadline,
/// for then it never goes before them (its laxity, which is its deadline less the time less what it has not had yet,
/// stays above 0). Else before all others, ready any time that leaves it its budget by the end of its period: bounds
/// only.
ResponseBounds fixed_priority_responses(const std::vector<TimedTask>& tasks);

}  // namespace takt::analysis
