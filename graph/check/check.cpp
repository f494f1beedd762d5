// SPDX-License-Identifier: Apache-2.0
#include "graph/check/check.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "graph/check/check_text.hpp"
#include "graph/check/margins.hpp"
#include "graph/check/measured.hpp"
#include "rt/sched/lane.hpp"
#include "rt/sched/lane_tasks.hpp"
#include "rt/sched/mode_log.hpp"
#include "rt/time/units.hpp"

namespace takt::graph {
namespace {

void add_pools(const Plan& plan, CheckResult& result) {
  for (const PortPlan& port : plan.ports) {
    const uint64_t bytes = port.chunk_bytes() * port.chunks();
    result.pool_bytes += bytes;
    result.pools.push_back({port.node + "." + port.port, port.chunks(), bytes});
  }
}

/// Under `fixed` as placed; else the largest first, each where most is free.
void spread_over_cores(const Plan& plan, const analysis::Overheads& overheads, CheckResult& result) {
  for (const int core : plan.cores) result.core_use.push_back({core, 0});
  if (result.core_use.empty()) result.core_use.push_back({0, 0});
  const auto share = [&](size_t t) {
    return static_cast<double>(plan.tasks[t].budget_ns) * 1e-9 * effective_rate_hz(plan, t);
  };
  if (plan.policy == Policy::fixed) {
    const LaneTasks placed = lane_tasks(plan, plan.policy, overheads);
    for (size_t l = 0; l < placed.lanes.size(); ++l)
      for (const size_t t : placed.lanes[l])
        result.core_use[static_cast<size_t>(placed.set.tasks[l].core)].utilisation += share(t);
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

std::string name_of(const AgeBound& age) { return (age.edge ? "edge " : "chain ") + age.name; }

void judge_ages(ModeCheck& mode, CheckResult& result) {
  for (const AgeBound& age : mode.ages) {
    const std::string name = name_of(age);
    if (!age.possible()) {
      result.verdict = Verdict::invalid;
      mode.problems.push_back(
          fmt::format("{}: max_age is {} ms, but with these rates and offsets its data is up to {:.3f} "
                      "ms old even if every job took no time; raise it, or a rate",
                      name, to_ms(age.max_age_ns), to_ms(age.least_ns)));
    } else if (mode.admission.answer == Answer::admitted && !age.proven()) {
      mode.problems.push_back(age.bound_ns ? fmt::format("{}: max_age is {} ms, and the bound on its age is {:.3f} ms",
                                                         name, to_ms(age.max_age_ns), to_ms(*age.bound_ns))
                                           : fmt::format("{}: no bound on its age: {}", name, age.why));
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

/// One change that makes the ages of an admitted plan fit: a later max_age where only one is too early, or what the
/// schedule could say.
std::optional<Change> change_for_ages(const GraphSpec& graph, const Plan& plan, const ModeCheck& mode,
                                      const analysis::Overheads& overheads) {
  std::vector<const AgeBound*> late;
  for (const AgeBound& age : mode.ages)
    if (!age.proven()) late.push_back(&age);
  if (late.empty()) return std::nullopt;
  std::optional<Change> later;
  constexpr int64_t kMicrosecond = 1'000;
  if (const AgeBound& age = *late.front(); late.size() == 1 && age.bound_ns) {
    const int64_t enough = (*age.bound_ns + kMicrosecond - 1) / kMicrosecond * kMicrosecond;
    later = Change{Change::What::max_age,
                   kNone,
                   to_ms(age.max_age_ns),
                   to_ms(enough),
                   static_cast<double>(enough - age.max_age_ns) / static_cast<double>(age.max_age_ns),
                   name_of(age)};
  }
  return smallest_age_change(
      plan, [&](const Plan& changed) { return holds(graph, changed, overheads); }, later);
}

ModeCheck check_mode(const GraphSpec& graph, const Plan& plan, const std::string& name, const CheckOptions& options,
                     CheckResult& result) {
  ModeCheck mode;
  mode.mode = name;
  mode.admission = admit(plan, options.machine.overheads);
  for (const TaskPlan& task : plan.tasks) mode.tasks.push_back(task.name);
  mode.problems = mode.admission.reasons;
  mode.ages = age_bounds(graph, plan, mode.admission.nodes);
  const auto change = mode.admission.answer != Answer::admitted
                          ? smallest_change(plan, options.machine.overheads)
                          : change_for_ages(graph, plan, mode, options.machine.overheads);
  if (change)
    mode.change = fmt::format("the smallest single change that makes it fit: {} ({:.1f} %)", to_string(*change, plan),
                              100 * change->relative);
  judge_ages(mode, result);
  return mode;
}

Answer answer_of(const ModeCheck& mode) {
  if (mode.admission.answer != Answer::admitted) return mode.admission.answer;
  return mode.problems.empty() ? Answer::admitted : Answer::not_proven;
}

/// As ModeLog promises: the last job that was released before the change ends by its deadline, and the first one
/// behind it comes within a period.
int64_t change_within_ns(const Plan& plan, const std::vector<char>& runs) {
  int64_t longest_ns = 0;
  for (size_t t = 0; t < plan.tasks.size(); ++t) {
    const TaskPlan& task = plan.tasks[t];
    longest_ns = std::max(longest_ns, task.deadline_ns);
    const double rate = effective_rate_hz(plan, t);
    if (!runs[t] || rate <= 0) continue;
    const auto period = static_cast<int64_t>(std::ceil(1e9 / rate));
    longest_ns = std::max(longest_ns, period + (task.min_interval_ns + period - 1) / period * period);
  }
  return ModeLog::kLead_ns + longest_ns;
}

/// Every lane named the core that the executor puts it on: which one that is depends on the overheads, and on all
/// lanes, those that a mode leaves out included.
Plan placed(const Plan& plan, const analysis::Overheads& overheads) {
  if (plan.policy != Policy::fixed || plan.cores.empty()) return plan;
  Plan result = plan;
  const LaneTasks lanes = lane_tasks(plan, plan.policy, overheads);
  for (size_t l = 0; l < lanes.lanes.size(); ++l)
    result.tasks[lanes.lanes[l].front()].core = plan.cores[static_cast<size_t>(lanes.set.tasks[l].core)];
  return result;
}

/// Under `fixed`, the heads of lanes in the order of their priorities; with other overheads it may be another one.
std::vector<std::string> order_of_lanes(const Plan& plan, const analysis::Overheads& overheads) {
  if (plan.policy != Policy::fixed) return {};
  const LaneTasks lanes = lane_tasks(plan, plan.policy, overheads);
  std::vector<std::pair<int, std::string>> order;
  for (size_t l = 0; l < lanes.lanes.size(); ++l)
    order.emplace_back(-lanes.set.tasks[l].priority, plan.tasks[lanes.lanes[l].front()].name);
  std::sort(order.begin(), order.end());
  std::vector<std::string> heads;
  for (const auto& [priority, head] : order) heads.push_back(head);
  return heads;
}

/// The plan in its mode of that index.
Plan in_mode(const Plan& plan, size_t mode) {
  std::vector<std::string> paused;
  for (size_t t = 0; mode > 0 && t < plan.tasks.size(); ++t)
    if (!plan.modes[mode].runs[t]) paused.push_back(plan.tasks[t].name);
  return without(plan, paused);
}

/// Why a mode is not admitted; "" if it is. `as_it_runs`: it was analysed in the order of priorities that it runs in.
std::string why_not(const ModeCheck& mode, bool as_it_runs) {
  if (mode.admission.answer != Answer::admitted)
    return mode.admission.reasons.empty() ? std::string(to_string(mode.admission.answer))
                                          : mode.admission.reasons.front();
  for (const AgeBound& age : mode.ages)
    if (!age.proven()) return "the age of " + name_of(age);
  return as_it_runs ? "" : "other priorities would be needed";
}

/// Takes the place of an admission by overheads that some jobs exceed, if the worst that were observed admit as well.
void admit_at_worst(const GraphSpec& graph, const Plan& plan, const CheckMachine& machine, CheckResult& result) {
  if (!machine.worst || result.answer != Answer::admitted) return;
  const Plan runs = placed(plan, machine.overheads);
  std::vector<ModeCheck> modes = result.modes;
  for (size_t m = 0; m < modes.size(); ++m) {
    const Plan reduced = in_mode(runs, m);
    modes[m].admission = admit(reduced, *machine.worst);
    modes[m].ages = age_bounds(graph, reduced, modes[m].admission.nodes);
    const std::string why =
        why_not(modes[m], order_of_lanes(reduced, machine.overheads) == order_of_lanes(reduced, *machine.worst));
    if (why.empty()) continue;
    result.notes.push_back(fmt::format(
        "admitted at p99: with the worst overheads that were observed, and {:.0f} % more, it is not proven ({})",
        100 * kWorstMargin, why));
    return;
  }
  result.modes = std::move(modes);
  result.basis = OverheadBasis::worst;
  result.charged = *machine.worst;
}

void check_modes(const GraphSpec& graph, const Plan& plan, const CheckOptions& options, CheckResult& result) {
  const Plan runs = placed(plan, options.machine.overheads);
  for (size_t m = 0; m < std::max<size_t>(plan.modes.size(), 1); ++m) {
    const std::string& name = m == 0 ? plan.mode : plan.modes[m].name;
    result.modes.push_back(check_mode(graph, m == 0 ? plan : in_mode(runs, m), name, options, result));
    result.modes.back().change_within_ns =
        change_within_ns(plan, m == 0 ? std::vector<char>(plan.tasks.size(), 1) : plan.modes[m].runs);
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

/// More than the network carries is lost, whatever the jobs do.
void add_network(const GraphSpec& graph, const Plan& plan, CheckResult& result) {
  result.network = check_network(graph, plan, machine::SystemFacts());
  if (!result.network) return;
  result.notes.insert(result.notes.end(), result.network->notes.begin(), result.network->notes.end());
  if (result.network->problem.empty()) return;
  result.problems.push_back(result.network->problem);
  if (result.answer == Answer::admitted) result.answer = Answer::not_proven;
}

/// Margins of each mode; a budget of the whole plan counts in the others as well.
void add_margins(const GraphSpec& graph, const Plan& plan, const analysis::Overheads& overheads, CheckResult& result) {
  const auto all_hold = [&](const Plan& changed) {
    for (size_t m = 0; m < result.modes.size(); ++m)
      if (!holds(graph, in_mode(changed, m), overheads)) return false;
    return true;
  };
  for (size_t m = 0; m < result.modes.size(); ++m)
    result.modes[m].margins_ns = margins(
        in_mode(plan, m), overheads,
        m == 0 ? Accepts(all_hold) : [&](const Plan& changed) { return holds(graph, changed, overheads); });
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
  const PortProducers producers(plan);
  const auto gone = [&](const EdgePlan& edge) {
    const size_t producer = producers.find(edge.port);
    return producer != kNone && out[producer];
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
  spread_over_cores(plan, options.machine.overheads, result);
  if (const std::string wrong = options.real_time ? wrong_cores(graph, plan, options.machine) : ""; !wrong.empty()) {
    result.verdict = Verdict::invalid;
    result.problems.push_back(to_string(Problem{graph.schedule.cores_position, wrong}));
  }
  check_modes(graph, plan, options, result);
  result.bandwidth_within_ns = bandwidth_within_ns(reservations(plan, plan.policy));
  result.notes = result.modes.front().admission.notes;
  result.basis = options.machine.measured ? OverheadBasis::p99 : OverheadBasis::assumed;
  result.charged = options.machine.overheads;
  admit_at_worst(graph, plan, options.machine, result);
  if (options.real_time && plan.policy != Policy::cooperative && !options.machine.not_preemptible.empty())
    result.notes.push_back(options.machine.not_preemptible);
  add_network(graph, plan, result);
  result.admitted = result.answer == Answer::admitted && result.verdict != Verdict::invalid;
  if (result.admitted && options.margins) add_margins(graph, plan, result.charged, result);
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
