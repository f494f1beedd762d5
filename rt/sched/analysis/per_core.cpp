// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/analysis/per_core.hpp"

#include "rt/sched/analysis/edf.hpp"
#include "rt/sched/analysis/fixed_priority.hpp"

namespace takt::analysis {
namespace {

struct OneCore {
  std::vector<size_t> indexes = {};  ///< in the set
  std::vector<TimedTask> tasks = {};
};

ResponseBounds responses(const std::vector<TimedTask>& tasks, CorePolicy policy) {
  switch (policy) {
    case CorePolicy::fixed_priority: return fixed_priority_responses(tasks);
    case CorePolicy::edf: return edf_responses(tasks);
    case CorePolicy::non_preemptive_edf: return non_preemptive_edf_responses(tasks);
  }
  return {};
}

DemandAnswer demand(const std::vector<TimedTask>& tasks, CorePolicy policy) {
  switch (policy) {
    case CorePolicy::fixed_priority: return {};
    case CorePolicy::edf: return edf_demand_test(tasks);
    case CorePolicy::non_preemptive_edf: return non_preemptive_edf_demand_test(tasks);
  }
  return {};
}

std::string first_late(const OneCore& core, const ResponseBounds& found) {
  for (size_t i = 0; i < core.tasks.size(); ++i) {
    const TimedTask& task = core.tasks[i];
    if (!found.bounds[i]) return "task '" + task.name + "': no bound on its response";
    if (*found.bounds[i] > task.deadline) {
      return "task '" + task.name + "': response " + std::to_string(*found.bounds[i]) + " above its deadline " +
             std::to_string(task.deadline);
    }
  }
  return {};
}

std::string describe(const Overload& overload) {
  return "an interval of " + std::to_string(overload.length) + " has a demand of " + std::to_string(overload.demand);
}

CoreAnalysis analyse_core(const OneCore& core, CorePolicy policy) {
  CoreAnalysis answer;
  answer.responses = responses(core.tasks, policy);
  const DemandAnswer demanded = demand(core.tasks, policy);
  const Verdict from_responses = verdict_of(core.tasks, answer.responses);
  // Either may prove what the other cannot (both sufficient, or one out of its range).
  answer.verdict = demanded.verdict != Verdict::not_proven ? demanded.verdict : from_responses;
  if (from_responses == Verdict::schedulable) answer.verdict = Verdict::schedulable;
  if (answer.verdict == Verdict::schedulable) return answer;
  answer.why = first_late(core, answer.responses);
  if (answer.why.empty() && demanded.overload) answer.why = describe(*demanded.overload);
  if (answer.why.empty()) answer.why = "no proof within the range of the analysis";
  return answer;
}

Verdict worse(Verdict a, Verdict b) {
  const auto rank = [](Verdict verdict) {
    return verdict == Verdict::not_schedulable ? 2 : verdict == Verdict::not_proven ? 1 : 0;
  };
  return rank(a) >= rank(b) ? a : b;
}

}  // namespace

Verdict verdict_of(const std::vector<TimedTask>& tasks, const ResponseBounds& responses) {
  const std::optional<int> load = compare_utilisation_with_one(tasks);
  if (load && *load > 0) return Verdict::not_schedulable;
  bool late = false;
  for (size_t i = 0; i < tasks.size(); ++i) {
    if (!responses.bounds[i]) return Verdict::not_proven;
    late = late || *responses.bounds[i] > tasks[i].deadline;
  }
  if (!late) return Verdict::schedulable;
  return responses.exact ? Verdict::not_schedulable : Verdict::not_proven;
}

Verdict core_verdict(const std::vector<TimedTask>& tasks, CorePolicy policy) {
  const Verdict demanded = demand(tasks, policy).verdict;
  return demanded != Verdict::not_proven ? demanded : verdict_of(tasks, responses(tasks, policy));
}

CoreAnalysis analyse(const TaskSet& set, CorePolicy policy) {
  CoreAnalysis answer;
  answer.responses.bounds.resize(set.tasks.size());
  answer.why = defect(set);
  if (!answer.why.empty()) return answer;
  std::vector<OneCore> cores(static_cast<size_t>(set.cores));
  for (size_t i = 0; i < set.tasks.size(); ++i) {
    const int core = set.tasks[i].core < 0 && set.cores == 1 ? 0 : set.tasks[i].core;
    if (core < 0) {
      answer.why = "task '" + set.tasks[i].name + "' has no core";
      return answer;
    }
    cores[static_cast<size_t>(core)].indexes.push_back(i);
    cores[static_cast<size_t>(core)].tasks.push_back(set.tasks[i]);
  }
  answer.verdict = Verdict::schedulable;
  for (const OneCore& core : cores) {
    const CoreAnalysis one = analyse_core(core, policy);
    answer.verdict = worse(answer.verdict, one.verdict);
    answer.responses.exact = answer.responses.exact && one.responses.exact;
    if (answer.why.empty()) answer.why = one.why;
    for (size_t i = 0; i < core.indexes.size(); ++i) answer.responses.bounds[core.indexes[i]] = one.responses.bounds[i];
  }
  return answer;
}

}  // namespace takt::analysis
