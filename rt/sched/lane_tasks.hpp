// SPDX-License-Identifier: Apache-2.0
// The lanes of a plan as the tasks that the analyses look at, and what each lane asks of the kernel. The executor and
// the admission use the same functions, so that what was proven is what runs.
#pragma once
#include <span>
#include <vector>

#include "rt/sched/analysis/overheads.hpp"
#include "rt/sched/analysis/task_set.hpp"
#include "rt/sched/grant.hpp"
#include "rt/sched/plan.hpp"

namespace takt {

struct LaneTasks {
  std::vector<std::vector<size_t>> lanes;  ///< as lane_members() gives them
  analysis::TaskSet set;                   ///< the lanes' tasks in the same order, with the names of their heads, first
  std::vector<int64_t> looks_ns;           ///< by lane: what its own watchdog takes in one pass, part of the budget
};

/// One task per lane: the head's rate and offset, the lane's span as deadline, the sum of the members' budgets and the
/// overheads of their jobs. A lane that waits within (`publish: let` before a follower) occupies its thread meanwhile,
/// so the wait counts as budget. One whose head sleeps for its data (SourcePlan::wait_ns) is woken twice and does its
/// work up to that much later, which is jitter. Under `deadline` the kernel gives it a new deadline when it wakes, so
/// it is a sporadic task with the figures of its reservation, done by the sleep and its response.
///
/// Under `deadline` the deadline is that of the reservation. Under `fixed` every task has its core (an index into
/// Plan::cores) and its SCHED_FIFO priority: on the core that the plan names, else where
/// `analysis::partition` puts it; what that finds no place for goes where the least work is. On each core deadline
/// monotonic, lanes with a member of high criticality before all others where all deadlines hold then, too. Priorities
/// count from the top of each core, kLaneStep apart; lanes beyond kMostLanesOfCore share the last one. In the list the
/// lanes are followed by one task per core for ordinary threads, if they have a share, and one for the looks of the
/// watchdogs that go before all lanes, if these are charged. Throws std::logic_error as lane_members() does.
LaneTasks lane_tasks(const Plan& plan, Policy policy, const analysis::Overheads& overheads = {});

/// Longest occupation of the thread from the start of the first of these members of a lane (positions in it, ascending)
/// to the publication of the last, without what other lanes take from it: their budgets and what the runtime adds to
/// each. Whoever follows a `let` output of one of them waits for its instant.
int64_t occupied_ns(const Plan& plan, const std::vector<size_t>& lane, std::span<const size_t> members,
                    const analysis::Overheads& overheads = {});
/// What comes before that where a thread has slept: it is woken, and goes to sleep again.
inline int64_t begin_ns(const analysis::Overheads& overheads) { return overheads.release_ns + 2 * overheads.switch_ns; }

/// One of these is of high criticality.
bool any_high(const Plan& plan, std::span<const size_t> tasks);

/// What each lane asks of the kernel under that policy, in the order of lane_members(). Depends on the plan alone, its
/// overheads included, so that every process of a run comes to the same.
std::vector<Reservation> reservations(const Plan& plan, Policy policy);

}  // namespace takt
