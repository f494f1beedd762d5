// SPDX-License-Identifier: Apache-2.0
#include "graph/check/check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <numeric>

#include "rt/sched/lane.hpp"

namespace takt::graph {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kRounding = 1e-9;  // a sum of shares may miss the whole by this much

double ms(int64_t ns) { return static_cast<double>(ns) / 1e6; }

void add_tasks(const Plan& plan, CheckResult& result) {
  result.text +=
      fmt::format("{:<16} {:>7} {:>10} {:>11} {:>12}\n", "node", "Hz", "budget ms", "deadline ms", "utilisation");
  for (size_t t = 0; t < plan.tasks.size(); ++t) {
    const TaskPlan& task = plan.tasks[t];
    const double rate = effective_rate_hz(plan, t), share = static_cast<double>(task.budget_ns) * 1e-9 * rate;
    if (task.budget_ns == 0) result.unbudgeted.push_back(task.name);
    result.utilisation += share;
    result.text += fmt::format("{:<16} {:>7.3g} {:>10.3f} {:>11.3f} {:>12.3f}\n", task.name, rate, ms(task.budget_ns),
                               ms(task.deadline_ns), share);
    result.json["nodes"].push_back({{"name", task.name},
                                    {"rate_hz", rate},
                                    {"budget_ms", ms(task.budget_ns)},
                                    {"deadline_ms", ms(task.deadline_ns)},
                                    {"utilisation", share}});
  }
}

void add_pools(const Plan& plan, CheckResult& result) {
  result.text += fmt::format("{:<28} {:<14} {:>10} {:>7} {:>9}\n", "pool", "type", "bytes", "chunks", "MB");
  for (const PortPlan& port : plan.ports) {
    const uint64_t bytes = port.chunk_bytes() * port.chunks();
    result.pool_bytes += bytes;
    result.text += fmt::format("{:<28} {:<14} {:>10} {:>7} {:>9.2f}\n", port.node + "." + port.port, port.type->name,
                               port.chunk_bytes(), port.chunks(), static_cast<double>(bytes) / 1e6);
    result.pools.push_back({port.node + "." + port.port, port.chunks(), bytes});
    result.json["pools"].push_back({{"port", port.node + "." + port.port},
                                    {"type", port.type->name},
                                    {"bytes", port.chunk_bytes()},
                                    {"chunks", port.chunks()}});
  }
}

/// What no schedule can do, task by task (design 4: a budget above its deadline is infeasible, not invalid).
void find_impossible(const Plan& plan, CheckResult& result) {
  for (size_t t = 0; t < plan.tasks.size(); ++t) {
    const TaskPlan& task = plan.tasks[t];
    const double rate = effective_rate_hz(plan, t);
    if (task.deadline_ns > 0 && task.budget_ns > task.deadline_ns)
      result.problems.push_back(
          fmt::format("{}: its budget of {} ms is above its deadline of {} ms; give it a deadline from "
                      "{} ms on or a smaller budget",
                      task.name, ms(task.budget_ns), ms(task.deadline_ns), ms(task.budget_ns)));
    else if (static_cast<double>(task.budget_ns) * 1e-9 * rate > 1 + kRounding)
      result.problems.push_back(
          fmt::format("{}: its budget of {} ms at {:.4g} Hz is more than one core, and a job runs on "
                      "one; at most {:.4g} Hz would fit",
                      task.name, ms(task.budget_ns), rate, 1e9 / static_cast<double>(task.budget_ns)));
  }
}

void spread_over_cores(const Plan& plan, CheckResult& result) {
  for (const int core : plan.cores) result.core_use.push_back({core, 0});
  if (result.core_use.empty()) result.core_use.push_back({0, 0});
  std::vector<double> shares;
  for (size_t t = 0; t < plan.tasks.size(); ++t)
    shares.push_back(static_cast<double>(plan.tasks[t].budget_ns) * 1e-9 * effective_rate_hz(plan, t));
  std::sort(shares.begin(), shares.end(), std::greater<>());
  for (const double share : shares)
    std::min_element(result.core_use.begin(), result.core_use.end(), [](const CoreUse& a, const CoreUse& b) {
      return a.utilisation < b.utilisation;
    })->utilisation += share;
  for (const CoreUse& use : result.core_use)
    result.json["core_use"].push_back({{"core", use.core}, {"utilisation", use.utilisation}});
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

CheckResult check(const GraphSpec& graph, const Plan& plan) {
  CheckResult result;
  result.cores = std::max<size_t>(plan.cores.size(), 1);
  add_tasks(plan, result);
  add_pools(plan, result);
  find_impossible(plan, result);
  spread_over_cores(plan, result);
  if (result.utilisation > static_cast<double>(result.cores) + kRounding)
    result.problems.push_back(fmt::format("budgets ask for {:.2f} of {} core{}; lower rates or budgets",
                                          result.utilisation, result.cores, result.cores == 1 ? "" : "s"));
  result.admitted = result.problems.empty();
  result.verdict = graph.adjusted.empty() ? Verdict::valid : Verdict::adjusted;
  std::string verdict =
      fmt::format("{}: budgets ask for {:.2f} of {} core{}, pools take {:.1f} MB: {}\n", graph.name, result.utilisation,
                  result.cores, result.cores == 1 ? "" : "s", static_cast<double>(result.pool_bytes) / 1e6,
                  result.admitted ? "fits on average (response times are not analysed)" : "infeasible");
  for (const std::string& problem : result.problems) verdict += problem + "\n";
  for (const std::string& name : result.unbudgeted)
    verdict += fmt::format(
        "{}: no budget stated, not counted; `takt run` under the policy deadline reserves a quarter of its deadline\n",
        name);
  for (const auto& [low, high] : low_before_high(plan)) {
    result.notes.push_back(fmt::format(
        "{} (low criticality) runs on the worker of {} (high), which waits for it: a job of it that does not end would "
        "stop both; give {} a `rate`, or `criticality: high`",
        plan.tasks[low].name, plan.tasks[high].name, plan.tasks[low].name));
    verdict += result.notes.back() + "\n";
  }
  result.text = verdict + result.text;
  result.json["verdict"] = to_string(result.verdict);
  result.json["problems"] = result.problems;
  result.json["notes"] = result.notes;
  result.json["admitted"] = result.admitted;
  result.json["utilisation"] = result.utilisation;
  result.json["cores"] = result.cores;
  result.json["pool_bytes"] = result.pool_bytes;
  result.json["unbudgeted"] = result.unbudgeted;
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
