// SPDX-License-Identifier: Apache-2.0
#include "graph/check/check.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace takt::graph {
namespace {

using Json = nlohmann::ordered_json;

double ms(int64_t ns) { return static_cast<double>(ns) / 1e6; }

void add_tasks(const Plan& plan, CheckResult& result) {
  result.text += fmt::format("{:<16} {:>7} {:>10} {:>11} {:>12}\n", "node", "Hz", "budget ms", "deadline ms", "utilisation");
  for (size_t t = 0; t < plan.tasks.size(); ++t) {
    const TaskPlan& task = plan.tasks[t];
    const double rate = effective_rate_hz(plan, t), share = static_cast<double>(task.budget_ns) * 1e-9 * rate;
    if (task.budget_ns == 0) result.unbudgeted.push_back(task.name);
    result.utilisation += share;
    result.text += fmt::format("{:<16} {:>7.3g} {:>10.3f} {:>11.3f} {:>12.3f}\n", task.name, rate, ms(task.budget_ns),
                               ms(task.deadline_ns), share);
    result.json["nodes"].push_back({{"name", task.name}, {"rate_hz", rate}, {"budget_ms", ms(task.budget_ns)},
                                    {"deadline_ms", ms(task.deadline_ns)}, {"utilisation", share}});
  }
}

void add_pools(const Plan& plan, CheckResult& result) {
  result.text += fmt::format("{:<28} {:<14} {:>10} {:>7} {:>9}\n", "pool", "type", "bytes", "chunks", "MB");
  for (const PortPlan& port : plan.ports) {
    const uint64_t bytes = port.chunk_bytes() * port.chunks();
    result.pool_bytes += bytes;
    result.text += fmt::format("{:<28} {:<14} {:>10} {:>7} {:>9.2f}\n", port.node + "." + port.port, port.type->name,
                               port.chunk_bytes(), port.chunks(), static_cast<double>(bytes) / 1e6);
    result.json["pools"].push_back({{"port", port.node + "." + port.port}, {"type", port.type->name},
                                    {"bytes", port.chunk_bytes()}, {"chunks", port.chunks()}});
  }
}

}  // namespace

CheckResult check(const GraphSpec& graph, const Plan& plan) {
  CheckResult result;
  result.cores = std::max<size_t>(plan.cores.size(), 1);
  add_tasks(plan, result);
  add_pools(plan, result);
  result.admitted = result.utilisation <= static_cast<double>(result.cores);
  std::string verdict = fmt::format("{}: budgets ask for {:.2f} of {} core{}, pools take {:.1f} MB: {}\n", graph.name,
                                    result.utilisation, result.cores, result.cores == 1 ? "" : "s",
                                    static_cast<double>(result.pool_bytes) / 1e6,
                                    result.admitted ? "fits on average (response times are not analysed)" : "infeasible, lower rates or budgets");
  for (const std::string& name : result.unbudgeted)
    verdict += fmt::format("{}: no budget stated, not counted; `takt run` under the policy deadline reserves a quarter of its deadline\n", name);
  result.text = verdict + result.text;
  result.json["admitted"] = result.admitted;
  result.json["utilisation"] = result.utilisation;
  result.json["cores"] = result.cores;
  result.json["pool_bytes"] = result.pool_bytes;
  result.json["unbudgeted"] = result.unbudgeted;
  return result;
}

}  // namespace takt::graph
