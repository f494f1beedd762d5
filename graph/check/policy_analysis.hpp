// SPDX-License-Identifier: Apache-2.0
// Which analysis answers for which policy.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "rt/sched/analysis/task_set.hpp"
#include "rt/sched/plan.hpp"

namespace takt::graph {

/// infeasible: no scheduler could, or an exact analysis found a legal pattern of arrivals that misses.
enum class Answer : uint8_t { admitted, infeasible, not_proven };
std::string_view to_string(Answer answer);

struct SetAnswer {
  Answer answer = Answer::not_proven;
  std::string by;   ///< the analysis that decided
  std::string why;  ///< one sentence if not admitted
  /// By task, from the planned release, ticks; nothing where none was found. Valid if admitted.
  std::vector<std::optional<analysis::Ticks>> response;
};

/// deadline: global EDF, or exact EDF on one core. fixed: exact response times per core; tasks carry core and priority.
/// cooperative: non-preemptive EDF of one worker per core.
/// Without `responses` deadlines may stand in for them, which is faster.
SetAnswer analyse_set(const analysis::TaskSet& set, Policy policy, bool responses = true);

/// A piece of the work of one task of a set that analyse_set admitted.
struct Part {
  size_t task = 0;
  analysis::Ticks work = 0;  ///< at most
  /// True: what a job begins with. False: it gets ready the moment that the thread of the task has done what comes
  /// before it in the same job.
  bool first = true;
  /// If not first: bounds on that moment and on its end, from the job's planned release, and by how much the releases
  /// of others may be off. 0: not known, or some task of the set waits in the middle of its jobs.
  analysis::Ticks ready_by = 0, done_by = 0, slack = 0;
  /// Tasks of the same thread, which has done what came before and has not begun with what comes after; empty: not
  /// known.
  std::vector<size_t> same_thread = {};
};

/// Bound on its end, from its getting ready, ticks (of a first one: from the planned release); nothing where none is
/// found. `whole` is what analyse_set, with `responses`, said of the set.
std::optional<analysis::Ticks> response_of_part(const analysis::TaskSet& set, Policy policy, const SetAnswer& whole,
                                                const Part& part);

}  // namespace takt::graph
