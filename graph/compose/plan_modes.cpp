// SPDX-License-Identifier: Apache-2.0
#include "graph/compose/plan_modes.hpp"

#include <algorithm>
#include <set>

#include "rt/node.hpp"

namespace takt::graph {
namespace {

std::set<std::string> left_out_by(const GraphSpec& graph, const std::string& mode) {
  for (const ModeSpec& spec : graph.modes)
    if (spec.name == mode) return {spec.without.begin(), spec.without.end()};
  return {};
}

std::set<std::string> paused_by(const GraphSpec& graph, const std::string& mode) {
  for (const ModeSpec& spec : graph.modes)
    if (const auto paused = spec.pauses(); spec.name == mode) return {paused.begin(), paused.end()};
  return {};
}

ModePlan with_all_but(const Plan& plan, const std::string& name, const std::set<std::string>& left_out) {
  ModePlan mode{name, {}};
  for (const TaskPlan& task : plan.tasks) mode.runs.push_back(!left_out.contains(task.name));
  return mode;
}

/// Tasks whose output this one cannot do without: required inputs, and what releases it.
std::set<std::string> needs(const Plan& plan, const TaskPlan& task) {
  std::set<std::string> producers;
  for (const EdgePlan& edge : task.edges)
    if (task.node->inputs()[edge.input]->need() == Need::required) producers.insert(plan.ports[edge.port].node);
  if (task.on_task != kNone) producers.insert(plan.tasks[task.on_task].name);
  return producers;
}

ModePlan implied_safe_stop(const Plan& plan) {
  ModePlan mode{std::string(kSafeStopMode), {}};
  for (const TaskPlan& task : plan.tasks) mode.runs.push_back(task.device || task.criticality == Criticality::high);
  for (bool grew = true; grew;) {
    grew = false;
    for (size_t t = 0; t < plan.tasks.size(); ++t) {
      if (!mode.runs[t]) continue;
      const std::set<std::string> needed = needs(plan, plan.tasks[t]);
      for (size_t p = 0; p < plan.tasks.size(); ++p)
        if (!mode.runs[p] && needed.contains(plan.tasks[p].name)) mode.runs[p] = grew = true;
    }
  }
  return mode;
}

/// The rules by task and mode of this plan. A device that the mode of the start leaves out can not be lost.
ModeRules rules_of(const GraphSpec& graph, const Plan& plan) {
  ModeRules result;
  const auto bit_of = [&](const std::string& device) -> SourceSet {
    const auto task =
        std::find_if(plan.tasks.begin(), plan.tasks.end(), [&](const TaskPlan& t) { return t.name == device; });
    if (task == plan.tasks.end()) return 0;
    const auto t = static_cast<size_t>(task - plan.tasks.begin());
    const auto known = std::find(result.sources.begin(), result.sources.end(), t);
    const auto bit = static_cast<size_t>(known - result.sources.begin());
    if (known == result.sources.end()) result.sources.push_back(t);
    return SourceSet{1} << bit;
  };
  for (const ModeSpec& spec : graph.modes) {
    if (spec.lost.empty()) continue;
    ModeRule rule;
    for (const std::string& device : spec.lost) rule.covers |= bit_of(device);
    const auto mode =
        std::find_if(plan.modes.begin(), plan.modes.end(), [&](const ModePlan& m) { return m.name == spec.name; });
    if (mode != plan.modes.end()) rule.mode = static_cast<size_t>(mode - plan.modes.begin());
    result.rules.push_back(rule);
  }
  return result;
}

}  // namespace

void add_modes(const GraphSpec& graph, Plan& plan) {
  const std::set<std::string> missing = left_out_by(graph, graph.mode);
  plan.modes = {with_all_but(plan, graph.mode, {})};
  const auto add = [&](const std::string& name) {
    const std::set<std::string> left_out = left_out_by(graph, name);
    const bool reachable =
        name == kSafeStopMode || std::includes(left_out.begin(), left_out.end(), missing.begin(), missing.end());
    if (name != graph.mode && reachable) plan.modes.push_back(with_all_but(plan, name, paused_by(graph, name)));
  };
  add("full");
  for (const ModeSpec& mode : graph.modes)
    if (mode.defined) add(mode.name);
  const auto named = [&] {
    return std::find_if(plan.modes.begin(), plan.modes.end(),
                        [](const ModePlan& m) { return m.name == kSafeStopMode; });
  };
  if (named() == plan.modes.end()) plan.modes.push_back(implied_safe_stop(plan));
  plan.safe_stop = static_cast<size_t>(named() - plan.modes.begin());
  plan.mode_rules = rules_of(graph, plan);
}

}  // namespace takt::graph
