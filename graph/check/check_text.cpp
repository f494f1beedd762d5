// SPDX-License-Identifier: Apache-2.0
#include "graph/check/check_text.hpp"

#include <fmt/format.h>

#include <cmath>

#include "graph/check/machine_figures.hpp"
#include "rt/time/units.hpp"

namespace takt::graph {
namespace {

using Json = nlohmann::ordered_json;

std::string column(const std::optional<int64_t>& ns) { return ns ? fmt::format("{:.3f}", to_ms(*ns)) : "-"; }

Json number(const std::optional<int64_t>& ns) { return ns ? Json(to_ms(*ns)) : Json(nullptr); }

std::optional<int64_t> margin_of(const ModeCheck& mode, size_t t) {
  return t < mode.margins_ns.size() ? std::optional(mode.margins_ns[t]) : std::nullopt;
}

/// What the overheads claim; of assumed ones the line itself says it.
std::string basis_text(const CheckResult& result) {
  switch (result.basis) {
    case OverheadBasis::worst: return fmt::format(": the worst, and {:.0f} % more", 100 * kWorstMargin);
    case OverheadBasis::p99: return ": p99, 1 job in 100 may take longer";
    case OverheadBasis::assumed: return "";
  }
  return "";
}

std::string head_text(const GraphSpec& graph, const Plan& plan, const CheckOptions& options,
                      const CheckResult& result) {
  const Admission& admission = result.modes.front().admission;
  const bool invalid = result.verdict == Verdict::invalid;
  std::string text =
      fmt::format("{}: {}{} under {} on {} core{}", graph.name, invalid ? "Invalid" : to_string(result.answer),
                  result.admitted && result.basis == OverheadBasis::p99 ? " at p99" : "", to_string(plan.policy),
                  result.cores, result.cores == 1 ? "" : "s");
  if (!invalid && !admission.by.empty()) text += fmt::format(" ({})", admission.by);
  text += "\n";
  for (const std::string& problem : result.problems) text += problem + "\n";
  for (const ModeCheck& mode : result.modes)
    if (!mode.change.empty()) text += (mode.mode == plan.mode ? "" : "mode " + mode.mode + ": ") + mode.change + "\n";
  for (const std::string& note : result.notes) text += "note: " + note + "\n";
  for (const std::string& warning : result.warnings) text += "warning: " + warning + "\n";
  text += fmt::format("budgets ask for {:.2f} of {} core{}, pools take {:.1f} MB\n", result.utilisation, result.cores,
                      result.cores == 1 ? "" : "s", static_cast<double>(result.pool_bytes) / 1e6);
  if (result.network) text += network_text(*result.network, graph.network);
  if (!options.machine.overheads_from.empty()) {
    const analysis::Overheads& o = result.charged;
    text += fmt::format("{}{}\n  a job {:.0f} us + {:.1f} us per input or output, enforcement {:.2f} ms",
                        options.machine.overheads_from, basis_text(result),
                        static_cast<double>(o.release_ns + 2 * o.switch_ns) / 1e3,
                        static_cast<double>(std::max(o.take_ns, o.publish_ns)) / 1e3,
                        to_ms(plan.policy == Policy::fixed ? o.demotion_ns : o.throttled_late_ns()));
    if (plan.policy == Policy::deadline)
      text += fmt::format("\n  SCHED_DEADLINE has {:.2f} cores; of a process that died within {:.0f} ms again",
                          o.deadline_bandwidth, to_ms(result.bandwidth_within_ns));
    if (plan.policy == Policy::fixed && o.ordinary_runtime_ns > 0)
      text += fmt::format("\n  ordinary threads get {:g} ms of each {:g} ms of a core", to_ms(o.ordinary_runtime_ns),
                          to_ms(o.ordinary_period_ns));
    text += "\n";
  }
  return text;
}

std::string nodes_table(const Plan& plan, const ModeCheck& mode) {
  std::string text = fmt::format("{:<18} {:>6} {:>10} {:>11} {:>11} {:>10} {:>6}\n", "node", "Hz", "budget ms",
                                 "deadline ms", "response ms", "margin ms", "share");
  for (size_t t = 0; t < plan.tasks.size(); ++t) {
    const TaskPlan& task = plan.tasks[t];
    const double rate = effective_rate_hz(plan, t);
    text += fmt::format("{:<18} {:>6.3g} {:>10.3f} {:>11.3f} {:>11} {:>10} {:>6.3f}\n", task.name, rate,
                        to_ms(task.budget_ns), to_ms(task.deadline_ns), column(mode.admission.nodes[t].response_ns),
                        column(margin_of(mode, t)), static_cast<double>(task.budget_ns) * 1e-9 * rate);
  }
  return text;
}

std::string ages_table(const ModeCheck& mode) {
  if (mode.ages.empty()) return "";
  std::string text = fmt::format("{:<52} {:>12} {:>12}\n", "age of the newest data", "bound ms", "max_age ms");
  for (const AgeBound& age : mode.ages)
    text += fmt::format("{:<52} {:>12} {:>12.3f}\n", (age.edge ? "" : "chain ") + age.name, column(age.bound_ns),
                        to_ms(age.max_age_ns));
  return text;
}

/// What admission counts on of each device that gives anything: how old, and how long its job may sleep for it.
std::string sources_table(const Plan& plan) {
  std::string text =
      fmt::format("{:<52} {:>12} {:>12}\n", "stamps of a device, at the release of its job", "old ms", "waited ms");
  for (const TaskPlan& task : plan.tasks) {
    if (!task.device || task.ports.empty()) continue;
    const bool known = task.source.unknown.empty();
    text += fmt::format("{:<52} {:>12} {:>12.3f}\n", known ? task.name : task.name + " (not known)",
                        column(known ? std::optional(task.source.lag_ns) : std::nullopt), to_ms(task.source.wait_ns));
  }
  return text;
}

Json sources_json(const Plan& plan) {
  Json list = Json::array();
  for (const TaskPlan& task : plan.tasks) {
    if (!task.device || task.ports.empty()) continue;
    const bool known = task.source.unknown.empty();
    Json row{{"name", task.name},
             {"lag_ms", number(known ? std::optional(task.source.lag_ns) : std::nullopt)},
             {"wait_ms", to_ms(task.source.wait_ns)}};
    if (!known) row["unknown"] = task.source.unknown;
    list.push_back(std::move(row));
  }
  return list;
}

std::string modes_text(const CheckResult& result) {
  std::string text;
  for (size_t m = result.modes.size() > 1 ? 0 : 1; m < result.modes.size(); ++m) {
    const ModeCheck& mode = result.modes[m];
    text += fmt::format("mode {}: {} ({} nodes; {})\n  a change to it takes {:.0f} ms at most\n", mode.mode,
                        mode.problems.empty() ? "admitted" : "refused", mode.tasks.size(), mode.admission.by,
                        std::ceil(to_ms(mode.change_within_ns)));
  }
  return text;
}

std::string pools_table(const Plan& plan) {
  std::string text = fmt::format("{:<28} {:<14} {:>10} {:>7} {:>9}\n", "pool", "type", "bytes", "chunks", "MB");
  for (const PortPlan& port : plan.ports)
    text +=
        fmt::format("{:<28} {:<14} {:>10} {:>7} {:>9.2f}\n", port.node + "." + port.port, port.type->name,
                    port.chunk_bytes(), port.chunks(), static_cast<double>(port.chunk_bytes() * port.chunks()) / 1e6);
  return text;
}

Json ages_json(const ModeCheck& mode, bool edges) {
  Json list = Json::array();
  for (const AgeBound& age : mode.ages) {
    if (age.edge != edges) continue;
    Json row{{"name", age.name},
             {"bound_ms", number(age.bound_ns)},
             {"oldest_ms", number(age.oldest_ns)},
             {"least_ms", to_ms(age.least_ns)},
             {"max_age_ms", to_ms(age.max_age_ns)},
             {"within", age.proven()}};
    if (!age.why.empty()) row["why"] = age.why;
    list.push_back(std::move(row));
  }
  return list;
}

Json mode_json(const ModeCheck& mode) {
  Json row{{"name", mode.mode},
           {"answer", to_string(mode.admission.answer)},
           {"analysis", mode.admission.by},
           {"change_within_ms", to_ms(mode.change_within_ns)},
           {"problems", mode.problems},
           {"notes", mode.admission.notes},
           {"nodes", Json::array()}};
  if (!mode.change.empty()) row["change"] = mode.change;
  for (size_t t = 0; t < mode.tasks.size(); ++t)
    row["nodes"].push_back({{"name", mode.tasks[t]},
                            {"response_ms", number(mode.admission.nodes[t].response_ns)},
                            {"margin_ms", number(margin_of(mode, t))}});
  row["chains"] = ages_json(mode, false);
  row["edges"] = ages_json(mode, true);
  return row;
}

}  // namespace

std::string check_text(const GraphSpec& graph, const Plan& plan, const CheckOptions& options,
                       const CheckResult& result) {
  return head_text(graph, plan, options, result) + nodes_table(plan, result.modes.front()) + sources_table(plan) +
         ages_table(result.modes.front()) + modes_text(result) + pools_table(plan);
}

Json check_json(const Plan& plan, const CheckOptions& options, const CheckResult& result) {
  Json json;
  const ModeCheck& whole = result.modes.front();
  json["verdict"] = to_string(result.verdict);
  json["answer"] = to_string(result.answer);
  json["admitted"] = result.admitted;
  json["policy"] = to_string(plan.policy);
  json["analysis"] = whole.admission.by;
  json["problems"] = result.problems;
  json["notes"] = result.notes;
  if (result.network) json["network"] = to_json(*result.network);
  if (!whole.change.empty()) json["change"] = whole.change;
  json["utilisation"] = result.utilisation;
  json["cores"] = result.cores;
  json["overheads"] = {{"measured", options.machine.measured}, {"basis", to_string(result.basis)}};
  json["overheads"].update(overheads_json(result.charged));
  if (result.bandwidth_within_ns > 0) json["bandwidth_within_ms"] = to_ms(result.bandwidth_within_ns);
  json["warnings"] = result.warnings;
  json["nodes"] = Json::array();
  for (size_t t = 0; t < plan.tasks.size(); ++t) {
    const TaskPlan& task = plan.tasks[t];
    const double rate = effective_rate_hz(plan, t);
    json["nodes"].push_back({{"name", task.name},
                             {"rate_hz", rate},
                             {"budget_ms", to_ms(task.budget_ns)},
                             {"deadline_ms", to_ms(task.deadline_ns)},
                             {"response_ms", number(whole.admission.nodes[t].response_ns)},
                             {"margin_ms", number(margin_of(whole, t))},
                             {"utilisation", static_cast<double>(task.budget_ns) * 1e-9 * rate}});
  }
  json["sources"] = sources_json(plan);
  json["chains"] = ages_json(whole, false);
  json["edges"] = ages_json(whole, true);
  json["modes"] = Json::array();
  for (const ModeCheck& mode : result.modes) json["modes"].push_back(mode_json(mode));
  for (const CoreUse& use : result.core_use)
    json["core_use"].push_back({{"core", use.core}, {"utilisation", use.utilisation}});
  json["pool_bytes"] = result.pool_bytes;
  for (const PortPlan& port : plan.ports)
    json["pools"].push_back({{"port", port.node + "." + port.port},
                             {"type", port.type->name},
                             {"bytes", port.chunk_bytes()},
                             {"chunks", port.chunks()}});
  json["unbudgeted"] = result.unbudgeted;
  return json;
}

}  // namespace takt::graph
