// SPDX-License-Identifier: Apache-2.0
#include "graph/check/policy_analysis.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "rt/sched/analysis/global_edf.hpp"
#include "rt/sched/analysis/per_core.hpp"

namespace takt::graph {
namespace {

using analysis::TaskSet;

/// What no scheduler can do on that many cores.
std::string impossible(const TaskSet& set) {
  const double ms = 1e-6 / static_cast<double>(set.ticks_per_ns);
  for (const auto& t : set.tasks)
    if (t.budget + t.jitter > t.deadline)
      return fmt::format("{} needs up to {:.3f} ms with overheads, and has {:.3f} ms", t.name,
                         static_cast<double>(t.budget + t.jitter) * ms, static_cast<double>(t.deadline) * ms);
  constexpr double kRounding = 1e-9;
  if (const double all = set.utilisation(); all > set.cores + kRounding)
    return fmt::format("budgets and overheads ask for {:.2f} of {} core{}", all, set.cores, set.cores == 1 ? "" : "s");
  return "";
}

SetAnswer per_core(const TaskSet& set, analysis::CorePolicy policy, const char* by) {
  const analysis::CoreAnalysis found = analysis::analyse(set, policy);
  SetAnswer result{Answer::not_proven, by, found.why, found.responses.bounds};
  if (found.verdict == analysis::Verdict::schedulable) result.answer = Answer::admitted;
  // Exact for this assignment to cores; another one might fit.
  if (found.verdict == analysis::Verdict::not_schedulable && set.cores == 1) result.answer = Answer::infeasible;
  return result;
}

SetAnswer global(const TaskSet& set) {
  const analysis::GlobalEdfResult found = analysis::global_edf(set);
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

}  // namespace

std::string_view to_string(Answer answer) {
  switch (answer) {
    case Answer::admitted: return "admitted";
    case Answer::infeasible: return "infeasible";
    case Answer::not_proven: return "not proven";
  }
  return "";
}

SetAnswer analyse_set(const TaskSet& set, Policy policy) {
  if (const std::string why = impossible(set); !why.empty()) return {Answer::infeasible, "arithmetic", why, {}};
  switch (policy) {
    case Policy::deadline:
      return set.cores == 1 ? per_core(set, analysis::CorePolicy::edf, "EDF on one core, exact") : global(set);
    case Policy::fixed: return per_core(set, analysis::CorePolicy::fixed_priority, "fixed priorities per core, exact");
    case Policy::cooperative: break;
  }
  if (set.cores > 1) return {Answer::not_proven, "none", "no analysis of several cooperative workers", {}};
  return per_core(set, analysis::CorePolicy::non_preemptive_edf, "non-preemptive EDF on one core");
}

}  // namespace takt::graph
