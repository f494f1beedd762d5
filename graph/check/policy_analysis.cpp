// SPDX-License-Identifier: Apache-2.0
#include "graph/check/policy_analysis.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "rt/sched/analysis/continuation.hpp"
#include "rt/sched/analysis/edf.hpp"
#include "rt/sched/analysis/fixed_priority.hpp"
#include "rt/sched/analysis/global_edf.hpp"
#include "rt/sched/analysis/global_non_preemptive.hpp"
#include "rt/sched/analysis/per_core.hpp"

namespace takt::graph {
namespace {

using analysis::TaskSet;

double ms(const TaskSet& set, analysis::Ticks ticks) {
  return static_cast<double>(ticks) / static_cast<double>(set.ticks_per_ns) / 1e6;
}

/// What no scheduler can do on that many cores.
std::string impossible(const TaskSet& set) {
  for (const auto& t : set.tasks)
    if (t.budget + t.jitter > t.deadline)
      return fmt::format("{} needs up to {:.3f} ms with overheads, and has {:.3f} ms", t.name,
                         ms(set, t.budget + t.jitter), ms(set, t.deadline));
  constexpr double kRounding = 1e-9;
  if (const double all = set.utilisation(); all > set.cores + kRounding)
    return fmt::format("budgets and overheads ask for {:.2f} of {} core{}", all, set.cores, set.cores == 1 ? "" : "s");
  return "";
}

/// The first task whose response bound is missing or late, in ms.
std::string late_one(const TaskSet& set, const std::vector<std::optional<analysis::Ticks>>& bounds) {
  for (size_t t = 0; t < bounds.size(); ++t) {
    const analysis::TimedTask& task = set.tasks[t];
    if (!bounds[t]) return fmt::format("no bound on the response of {} is found", task.name);
    if (*bounds[t] > task.deadline)
      return fmt::format("{} may take {:.3f} ms from its release and has {:.3f} ms", task.name, ms(set, *bounds[t]),
                         ms(set, task.deadline));
  }
  return "";
}

SetAnswer per_core(const TaskSet& set, analysis::CorePolicy policy, const char* by) {
  const analysis::CoreAnalysis found = analysis::analyse(set, policy);
  SetAnswer result{Answer::not_proven, by, "", found.responses.bounds};
  result.response.resize(set.tasks.size());
  if (found.verdict == analysis::Verdict::schedulable) {
    result.answer = Answer::admitted;
    for (size_t t = 0; t < set.tasks.size(); ++t)
      if (!result.response[t] || *result.response[t] > set.tasks[t].deadline)
        result.response[t] = set.tasks[t].deadline;
    return result;
  }
  result.why = late_one(set, result.response);
  if (result.why.empty()) result.why = found.why;
  // Exact for this assignment to cores; another one might fit.
  if (found.verdict == analysis::Verdict::not_schedulable && set.cores == 1) result.answer = Answer::infeasible;
  return result;
}

SetAnswer global(const TaskSet& set, bool responses) {
  const analysis::GlobalEdfResult found = analysis::global_edf(set, responses);
  SetAnswer result{Answer::not_proven, fmt::format("global EDF, {} test", to_string(found.proven_by)), "", {}};
  for (const analysis::Ticks response : found.response)
    result.response.push_back(response < 0 ? std::nullopt : std::optional(response));
  if (found.schedulable()) {
    result.answer = Answer::admitted;
  } else {
    result.by = "global EDF: density, interference, response time, carry-in";
    const auto missing = global_response_times(set);
    std::string names;
    for (size_t t = 0; t < missing.size(); ++t)
      if (missing[t] < 0) names += (names.empty() ? "" : ", ") + set.tasks[t].name;
    result.why = fmt::format("no test of global EDF on {} cores proves the deadline of {}", set.cores,
                             names.empty() ? "every task at once" : names);
  }
  return result;
}

SetAnswer cooperative(const TaskSet& set, bool responses) {
  SetAnswer one;
  if (set.cores == 1) {
    one = per_core(set, analysis::CorePolicy::non_preemptive_edf, "non-preemptive EDF on one core");
    if (one.answer == Answer::infeasible || (one.answer == Answer::admitted && !responses)) return one;
  }
  const analysis::CoreAnalysis found = analysis::global_non_preemptive_edf(set);
  if (one.answer == Answer::admitted) {
    // That one takes whoever may block at the worst instant; with known offsets few of them come then.
    if (found.verdict == analysis::Verdict::schedulable)
      for (size_t t = 0; t < set.tasks.size(); ++t)
        one.response[t] = std::min(one.response[t], found.responses.bounds[t]);
    return one;
  }
  SetAnswer result{Answer::not_proven, "non-preemptive EDF, all schedules explored", found.why, found.responses.bounds};
  if (found.verdict == analysis::Verdict::schedulable) result.answer = Answer::admitted;
  return result;
}

/// As response_of_part() says, by the tasks that share the part's core.
std::optional<analysis::Ticks> part_on_core(const TaskSet& set, Policy policy, const Part& part) {
  std::vector<analysis::TimedTask> tasks{set.tasks[part.task]};
  for (size_t i = 0; i < set.tasks.size(); ++i) {
    const bool elsewhere = set.tasks[i].core != set.tasks[part.task].core;
    const auto& same = part.same_thread;
    if (i != part.task && !elsewhere && std::find(same.begin(), same.end(), i) == same.end())
      tasks.push_back(set.tasks[i]);
  }
  const bool edf = policy == Policy::deadline;
  // Above fixed priorities nothing is left of the task's job before. Under EDF that one has held up others, who now
  // come first; only behind work of the same job none of them waits.
  if (edf && part.first) return analysis::edf_response_of_first(tasks, 0, part.work);
  const auto core_policy = edf ? analysis::CorePolicy::edf : analysis::CorePolicy::fixed_priority;
  std::optional<analysis::Ticks> going_on;
  if (!part.first && part.ready_by > 0)
    going_on = continuation_response(tasks, core_policy, {0, part.work, part.ready_by, part.done_by, part.slack});
  tasks[0].budget = part.work;
  if (!part.first) {  // ready at any phase
    tasks[0].sporadic = true;
    tasks[0].offset = tasks[0].jitter = 0;
  }
  const auto alone = edf ? edf_responses(tasks).bounds[0] : fixed_priority_responses(tasks).bounds[0];
  if (!going_on || !alone) return going_on ? going_on : alone;
  return std::min(*going_on, *alone);
}

}  // namespace

std::string_view to_string(Answer answer) {
  switch (answer) {
    case Answer::admitted: return "admitted";
    case Answer::infeasible: return "infeasible";
    case Answer::not_proven: return "not proven";
  }
  return "";
}

SetAnswer analyse_set(const TaskSet& set, Policy policy, bool responses) {
  if (const std::string why = impossible(set); !why.empty()) return {Answer::infeasible, "arithmetic", why, {}};
  switch (policy) {
    case Policy::deadline:
      return set.cores == 1 ? per_core(set, analysis::CorePolicy::edf, "EDF on one core, exact")
                            : global(set, responses);
    case Policy::fixed: return per_core(set, analysis::CorePolicy::fixed_priority, "fixed priorities per core, exact");
    case Policy::cooperative: break;
  }
  return cooperative(set, responses);
}

std::optional<analysis::Ticks> response_of_part(const TaskSet& set, Policy policy, const SetAnswer& whole,
                                                const Part& part) {
  const size_t k = part.task;
  if (policy == Policy::cooperative && !part.first) return part.work;  // nobody comes between
  if (policy == Policy::deadline && set.cores > 1) {
    std::vector<analysis::Ticks> responses;
    for (const auto& response : whole.response) responses.push_back(*response);
    const analysis::Ticks found = analysis::global_response_of_part(set, k, part.work, responses);
    return found < 0 ? std::nullopt : std::optional(found);
  }
  // A job that goes on behind the part for all of its budget ends in time: the part was done by so much earlier.
  const analysis::Ticks bound = *whole.response[k] - (set.tasks[k].budget - part.work);
  if (policy == Policy::cooperative) return bound;
  return std::min(bound, part_on_core(set, policy, part).value_or(bound));
}

}  // namespace takt::graph
