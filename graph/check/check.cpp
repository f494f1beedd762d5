// SPDX-License-Identifier: Apache-2.0
#include "graph/check/check.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <functional>

#include "graph/check/check_text.hpp"
#include "graph/check/margins.hpp"
#include "graph/check/measured.hpp"
#include "rt/sched/lane.hpp"
#include "rt/sched/lane_tasks.hpp"

namespace takt::graph {
namespace {

double ms(int64_t ns) { return static_cast<double>(ns) / 1e6; }

void add_pools(const Plan& plan, CheckResult& result) {
  for (const PortPlan& port : plan.ports) {
    const uint64_t bytes = port.chunk_bytes() * port.chunks();
    result.pool_bytes += bytes;
    result.pools.push_back({port.node + "." + port.port, port.chunks(), bytes});
  }
}

/// Under `fixed` as placed; else the largest first, each where most is free.
void spread_over_cores(const Plan& plan, CheckResult& result) {
  for (const int core : plan.cores) result.core_use.push_back({core, 0});
  if (result.core_use.empty()) result.core_use.push_back({0, 0});
  const auto share = [&](size_t t) {
    return static_cast<double>(plan.tasks[t].budget_ns) * 1e-9 * effective_rate_hz(plan, t);
  };
  if (plan.policy == Policy::fixed) {
    const auto lanes = lane_members(plan);
    const Placement placement = place_fixed(plan);
    for (size_t l = 0; l < lanes.size(); ++l)
      for (const size_t t : lanes[l])
        result.core_use[static_cast<size_t>(std::max(placement.core[l], 0))].utilisation += share(t);
    return;
  }
  std::vector<double> shares;
  for (size_t t = 0; t < plan.tasks.size(); ++t) shares.push_back(share(t));
  std::sort(shares.begin(), shares.end(), std::greater<>());
  for (const double s : shares)
    std::min_element(result.core_use.begin(), result.core_use.end(), [](const CoreUse& a, const CoreUse& b) {
      return a.utilisation < b.utilisation;
    })->utilisation += s;
}

/// SCHED_DEADLINE takes no affinity: its threads run on all CPUs of their cpuset. Empty if that is what is asked for.
std::string wrong_cores(const GraphSpec& graph, const Plan& plan, const CheckMachine& machine) {
  // What the schedule says: the plan may have been limited to what the process may use.
  const std::vector<int>& asked = graph.schedule.cores;
  if (plan.policy != Policy::deadline || machine.online.empty() || asked.empty()) return "";
  const std::vector<int>& all = machine.exclusive.empty() ? machine.online : machine.exclusive;
  const auto wanted = [&](int cpu) { return std::find(asked.begin(), asked.end(), cpu) != asked.end(); };
  if (std::all_of(all.begin(), all.end(), wanted)) return "";
  return fmt::format(
      "`cores` is [{}], but threads under the policy deadline run on all of [{}]: SCHED_DEADLINE takes no affinity. "
      "Leave `cores` out, write `cores: [{}]`, start takt in an exclusive cpuset of the cores wanted (cgroup v2: "
      "cpuset.cpus and "
      "cpuset.cpus.partition = root), or choose `policy: fixed`",
      fmt::join(asked, ", "), fmt::join(all, ", "), fmt::join(all, ", "));
}

void judge_ages(ModeCheck& mode, CheckResult& result) {
  for (const AgeBound& age : mode.ages) {
    const std::string name = age.edge ? "edge " + age.name : "chain " + age.name;
    if (!age.possible()) {
      result.verdict = Verdict::invalid;
      mode.problems.push_back(
          fmt::format("{}: max_age is {} ms, but with these rates and offsets its data is up to {:.3f} "
                      "ms old even if every job took no time; raise it, or a rate",
                      name, ms(age.max_age_ns), ms(age.least_ns)));
    } else if (mode.admission.answer == Answer::admitted && !age.proven()) {
      mode.problems.push_back(age.bound_ns ? fmt::format("{}: max_age is {} ms, and the bound on its age is {:.3f} ms",
                                                         name, ms(age.max_age_ns), ms(*age.bound_ns))
                                           : fmt::format("{}: no bound on its age: {}", name, age.why));
    }
  }
}

ModeCheck check_mode(const GraphSpec& graph, const Plan& plan, const std::string& name, const CheckOptions& options,
                     CheckResult& result) {
  ModeCheck mode;
  mode.mode = name;
  mode.admission = admit(plan, options.machine.overheads);
  for (const TaskPlan& task : plan.tasks) mode.tasks.push_back(task.name);
  mode.problems = mode.admission.reasons;
  mode.ages = age_bounds(graph, plan, mode.admission.nodes);
  if (mode.admission.answer != Answer::admitted) {
    if (const auto change = smallest_change(plan, options.machine.overheads))
      mode.change = fmt::format("the smallest single change that makes it fit: {} ({:.1f} %)", to_string(*change, plan),
                                100 * change->relative);
  }
  judge_ages(mode, result);
  return mode;
}

Answer answer_of(const ModeCheck& mode) {
  if (mode.admission.answer != Answer::admitted) return mode.admission.answer;
  return mode.problems.empty() ? Answer::admitted : Answer::not_proven;
}

void check_modes(const GraphSpec& graph, const Plan& plan, const CheckOptions& options, CheckResult& result) {
  result.modes.push_back(check_mode(graph, plan, plan.mode, options, result));
  if (plan.mode == "full") {
    for (const ModeSpec& mode : graph.modes)
      if (mode.defined)
        result.modes.push_back(check_mode(graph, without(plan, mode.pauses()), mode.name, options, result));
  }
  result.answer = Answer::admitted;
  for (const ModeCheck& mode : result.modes) {
    const Answer answer = answer_of(mode);
    if (answer == Answer::infeasible || (answer == Answer::not_proven && result.answer == Answer::admitted))
      result.answer = answer;
    for (const std::string& problem : mode.problems) {
      const std::string text = mode.mode == plan.mode ? problem : "mode " + mode.mode + ": " + problem;
      if (std::find(result.problems.begin(), result.problems.end(), problem) == result.problems.end())
        result.problems.push_back(text);
    }
  }
}

/// What the check asks of one mode, without saying why not.
bool holds(const GraphSpec& graph, const Plan& plan, const analysis::Overheads& overheads) {
  const Admission admission = admit(plan, overheads);
  if (admission.answer != Answer::admitted) return false;
  const std::vector<AgeBound> ages = age_bounds(graph, plan, admission.nodes);
  return std::all_of(ages.begin(), ages.end(), [](const AgeBound& age) { return age.possible() && age.proven(); });
}

/// Margins of each mode; a budget of the whole plan counts in the others as well.
void add_margins(const GraphSpec& graph, const Plan& plan, const analysis::Overheads& overheads, CheckResult& result) {
  const auto plan_of = [&](const Plan& whole, const ModeCheck& mode) {
    const auto spec =
        std::find_if(graph.modes.begin(), graph.modes.end(), [&](const ModeSpec& m) { return m.name == mode.mode; });
    return &mode == &result.modes.front() || spec == graph.modes.end() ? whole : without(whole, spec->pauses());
  };
  const auto all_hold = [&](const Plan& changed) {
    return std::all_of(result.modes.begin(), result.modes.end(),
                       [&](const ModeCheck& mode) { return holds(graph, plan_of(changed, mode), overheads); });
  };
  for (ModeCheck& mode : result.modes) {
    const bool whole = &mode == &result.modes.front();
    mode.margins_ns = margins(
        plan_of(plan, mode), overheads,
        whole ? Accepts(all_hold) : [&](const Plan& changed) { return holds(graph, changed, overheads); });
  }
}

}  // namespace

std::string_view to_string(Verdict verdict) {
  switch (verdict) {
    case Verdict::valid: return "Valid";
    case Verdict::adjusted: return "Adjusted";
    case Verdict::invalid: return "Invalid";
  }
  return "";
}

Plan without(const Plan& plan, const std::vector<std::string>& names) {
  Plan result = plan;
  result.tasks.clear();
  std::vector<size_t> index(plan.tasks.size(), kNone);
  std::vector<char> out(plan.tasks.size(), 0);
  for (size_t t = 0; t < out.size(); ++t)
    out[t] = std::find(names.begin(), names.end(), plan.tasks[t].name) != names.end();
  for (size_t hops = 0; hops < out.size(); ++hops)
    for (size_t t = 0; t < out.size(); ++t)
      if (plan.tasks[t].on_task != kNone && out[plan.tasks[t].on_task]) out[t] = 1;
  for (size_t t = 0; t < out.size(); ++t) {
    if (out[t]) continue;
    index[t] = result.tasks.size();
    result.tasks.push_back(plan.tasks[t]);
  }
  const auto gone = [&](const EdgePlan& edge) {
    return std::any_of(plan.tasks.begin(), plan.tasks.end(), [&](const TaskPlan& task) {
      return out[static_cast<size_t>(&task - plan.tasks.data())] &&
             std::find(task.ports.begin(), task.ports.end(), edge.port) != task.ports.end();
    });
  };
  for (TaskPlan& task : result.tasks) {
    if (task.on_task != kNone) task.on_task = index[task.on_task];
    std::erase_if(task.edges, gone);
  }
  return result;
}

CheckResult check(const GraphSpec& graph, const Plan& plan, const CheckOptions& options) {
  CheckResult result;
  result.cores = std::max<size_t>(plan.cores.size(), 1);
  result.verdict = graph.adjusted.empty() ? Verdict::valid : Verdict::adjusted;
  for (size_t t = 0; t < plan.tasks.size(); ++t) {
    result.utilisation += static_cast<double>(plan.tasks[t].budget_ns) * 1e-9 * effective_rate_hz(plan, t);
    if (plan.tasks[t].budget_ns == 0) result.unbudgeted.push_back(plan.tasks[t].name);
  }
  result.warnings = options.machine.warnings;
  if (options.machine.identity.cores > 0) {
    const std::string elsewhere = measured_elsewhere(graph.schedule, options.machine.identity);
    if (!elsewhere.empty()) result.warnings.push_back(elsewhere);
  }
  add_pools(plan, result);
  spread_over_cores(plan, result);
  if (const std::string wrong = options.real_time ? wrong_cores(graph, plan, options.machine) : ""; !wrong.empty()) {
    result.verdict = Verdict::invalid;
    result.problems.push_back(to_string(Problem{graph.schedule.cores_position, wrong}));
  }
  check_modes(graph, plan, options, result);
  result.notes = result.modes.front().admission.notes;
  result.admitted = result.answer == Answer::admitted && result.verdict != Verdict::invalid;
  if (result.admitted && options.margins) add_margins(graph, plan, options.machine.overheads, result);
  result.text = check_text(graph, plan, options, result);
  result.json = check_json(plan, options, result);
  return result;
}

CheckResult check_failed(const std::vector<Problem>& problems) {
  CheckResult result;
  result.verdict = Verdict::invalid;
  for (const Problem& problem : problems) result.problems.push_back(to_string(problem));
  for (const std::string& problem : result.problems) result.text += problem + "\n";
  result.json["verdict"] = to_string(result.verdict);
  result.json["admitted"] = false;
  result.json["problems"] = result.problems;
  return result;
}

}  // namespace takt::graph
