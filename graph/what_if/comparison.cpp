// SPDX-License-Identifier: Apache-2.0
#include "graph/what_if/comparison.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "graph/expect/finding.hpp"
#include "graph/log/log_content.hpp"
#include "graph/run/report.hpp"

namespace takt::what_if {
namespace {

using Json = nlohmann::ordered_json;
using command::distribution;

constexpr double kMs = 1e6, kUs = 1e3;

Json nodes_json(const RecordedRun& recorded, const Plan& plan) {
  Json nodes = Json::array();
  for (size_t t = 0; t < plan.tasks.size(); ++t) {
    const RecordedFigures& figures = recorded.figures[t];
    nodes.push_back({{"name", plan.tasks[t].name},
                     {"samples", figures.jobs},
                     {"deadline_misses", figures.deadline_misses},
                     {"lateness_us", distribution(figures.lateness, kUs)},
                     {"exec_ms", distribution(figures.exec, kMs)},
                     {"response_ms", distribution(figures.response, kMs)}});
  }
  return nodes;
}

Json edges_json(const RecordedRun& recorded, const Plan& plan) {
  Json edges = Json::array();
  for (size_t t = 0; t < plan.tasks.size(); ++t)
    for (size_t e = 0; e < plan.tasks[t].edges.size(); ++e) {
      const EdgePlan& edge = plan.tasks[t].edges[e];
      const PortPlan& port = plan.ports[edge.port];
      edges.push_back({{"from", port.node + "." + port.port},
                       {"to", plan.tasks[t].name + "." + std::string(plan.tasks[t].node->inputs()[edge.input]->name())},
                       {"age_ms", distribution(recorded.figures[t].edge_age[e], kMs)}});
    }
  return edges;
}

Json chain_json(const graph::ChainSpec& chain, const Histogram& age) {
  return {{"name", chain.name},
          {"age_ms", distribution(age, kMs)},
          {"bound_ms", static_cast<double>(chain.max_age_ns) / kMs},
          {"within", age.count() > 0 ? Json(age.max_ns() <= chain.max_age_ns) : Json(nullptr)}};
}

Json chains_json(const RecordedRun& recorded, const Plan& plan, const graph::GraphSpec& graph) {
  Json chains = Json::array();
  for (const graph::ChainSpec& chain : graph.chains) {
    Histogram age;  // none: no node of that name
    for (size_t t = 0; t < plan.tasks.size(); ++t) {
      const TaskPlan& task = plan.tasks[t];
      if (task.name != chain.to.node) continue;
      for (size_t o = 0; o < task.ports.size(); ++o)
        if (plan.ports[task.ports[o]].port == chain.to.port) age = recorded.figures[t].output_age[o];
      for (size_t e = 0; e < task.edges.size(); ++e)
        if (task.node->inputs()[task.edges[e].input]->name() == chain.to.port) age = recorded.figures[t].edge_age[e];
    }
    chains.push_back(chain_json(chain, age));
  }
  return chains;
}

uint64_t misses(const Json& node) { return node["deadline_misses"].get<uint64_t>(); }

bool broken(const Json& node) { return node["criticality"] == "high" && misses(node) > 0; }

/// Five characters.
std::string figure(const Json& value) {
  if (value.is_null()) return "-";
  const auto number = value.get<double>();
  return fmt::format(fmt::runtime(number < 99.995 ? "{:.2f}" : number < 999.95 ? "{:.1f}" : "{:.0f}"), number);
}

constexpr const char* kNodeRow = "{:<16} {:>5} {:>5} {:>4} {:>4} {:>5} {:>5} {:>5} {:>5} {:>5} {:>5}\n";
constexpr const char* kChainRow = "{:<20} {:>5} {:>5} {:>5} {:>5} {:>5} {:>5} {:>5}  {}\n";

std::string node_line(const Json& was, const Json& is) {
  const auto count = [](const Json& node, const char* key) { return std::to_string(node[key].get<uint64_t>()); };
  const auto response = [](const Json& node, const char* key) { return figure(node["response_ms"][key]); };
  return fmt::format(fmt::runtime(kNodeRow), is["name"].get<std::string>().substr(0, 16), count(was, "samples"),
                     count(is, "samples"), count(was, "deadline_misses"), count(is, "deadline_misses"),
                     response(was, "p50"), response(is, "p50"), response(was, "p99"), response(is, "p99"),
                     response(was, "max"), response(is, "max"));
}

const char* verdict(const Json& chain) {
  return chain["within"].is_null() ? "no sample" : chain["within"].get<bool>() ? "within" : "EXCEEDED";
}

std::string chain_line(const Json& was, const Json& is) {
  const auto age = [](const Json& chain, const char* key) { return figure(chain["age_ms"][key]); };
  const std::string before = verdict(was), after = verdict(is);
  return fmt::format(fmt::runtime(kChainRow), is["name"].get<std::string>().substr(0, 20), age(was, "p50"),
                     age(is, "p50"), age(was, "p99"), age(is, "p99"), age(was, "max"), age(is, "max"),
                     fmt::format("{:.0f}", is["bound_ms"].get<double>()),
                     before == after ? after : before + " -> " + after);
}

/// What the figures lean on where the record does not say it.
std::string doubts_text(const Json& asked) {
  std::string text;
  for (const auto& [node, jobs] : asked["borrowed_jobs"].items())
    text += fmt::format("{}: {} jobs take the time of another job; the record has none at their place\n", node,
                        jobs.get<uint64_t>());
  if (const auto jobs = asked["cut_off_jobs"].get<uint64_t>(); jobs > 0)
    text += fmt::format("{} recorded jobs are left out: their process died in them\n", jobs);
  if (const auto messages = asked["unknown_stamps"].get<uint64_t>(); messages > 0)
    text += fmt::format("{} messages are not in the record: they get the stamp of the newest input\n", messages);
  if (const auto messages = asked["unknown_requests"].get<uint64_t>(); messages > 0)
    text += fmt::format("{} requests are in the record by hash only: they ask for nothing\n", messages);
  return text;
}

std::string verdict_text(const Json& comparison) {
  const Json& predicted = comparison["predicted"];
  if (predicted.contains("expectations")) {
    const Json& expected = predicted["expectations"];
    const auto left_out = expected["not_judged"].get<size_t>();
    return graph::findings_text(expected["conditions"]) +
           (left_out == 0 ? "" : fmt::format("not judged: {} conditions on messages or the world\n", left_out)) +
           (comparison["ok"].get<bool>() ? "as expected\n" : "NOT AS EXPECTED\n");
  }
  std::string text;
  for (const Json& node : predicted["nodes"])
    if (broken(node))
      text += fmt::format("{}{} {}", text.empty() ? "" : ", ", node["name"].get<std::string>(), misses(node));
  if (text.empty()) return "ok: every deadline of high criticality would hold\n";
  return "NOT OK: deadlines of high criticality would be missed: " + text + "\n";
}

}  // namespace

Json recorded_json(const RecordedRun& recorded, const Plan& plan, const graph::GraphSpec& graph,
                   const mcap::Metadata& facts, const mcap::Metadata& end) {
  const auto lost = [&](const char* what) { return std::strtoull(log::fact(end, what).c_str(), nullptr, 10); };
  return {{"graph", graph.name},
          {"schedule", log::fact(facts, "schedule")},
          {"profile", log::fact(facts, "profile")},
          {"clock", log::fact(facts, "clock")},
          {"policy_asked", log::fact(facts, "policy_asked")},
          {"policy_granted", log::fact(end, "policy_granted")},
          {"duration_s", static_cast<double>(recorded.end_ns - recorded.from_ns) / 1e9},
          {"nodes", nodes_json(recorded, plan)},
          {"edges", edges_json(recorded, plan)},
          {"chains", chains_json(recorded, plan, graph)},
          {"recorder_lost", lost("lost_overwritten") + lost("lost_no_room") + lost("lost_not_written") +
                                lost("lost_jobs") + lost("lost_threads")}};
}

Json comparison_json(const Asked& asked, const Plan& plan, const RecordedRun& recorded, const Prediction& prediction,
                     Json recorded_report, Json predicted_report) {
  Json borrowed = Json::object();
  for (size_t t = 0; t < plan.tasks.size(); ++t)
    if (prediction.borrowed[t] > 0) borrowed[plan.tasks[t].name] = prediction.borrowed[t];
  Json comparison;
  comparison["what_if"] = {{"record", asked.record},
                           {"schedule", asked.schedule},
                           {"policy", to_string(plan.policy)},
                           {"cores", plan.cores.size()},
                           {"speed", asked.speed},
                           {"borrowed_jobs", borrowed},
                           {"cut_off_jobs", recorded.cut_off},
                           {"unknown_stamps", recorded.unknown_stamps},
                           {"unknown_requests", recorded.unknown_requests}};
  const Json& nodes = predicted_report["nodes"];
  comparison["ok"] = predicted_report.contains("expectations") ? predicted_report["expectations"]["met"].get<bool>()
                                                               : std::none_of(nodes.begin(), nodes.end(), broken);
  comparison["recorded"] = std::move(recorded_report);
  comparison["predicted"] = std::move(predicted_report);
  return comparison;
}

std::string comparison_text(const Json& comparison) {
  const Json &asked = comparison["what_if"], &was = comparison["recorded"], &is = comparison["predicted"];
  std::string text = fmt::format(
      "{} on {}, {} core{}, speed {:g}, policy {}: {:.1f} s, predicted from\n{} ({} clock, {} on {})\n"
      "Recorded times on simulated cores; no node ran. Each pair: recorded, predicted.\n\n",
      is["graph"].get<std::string>(), is["schedule"].get<std::string>(), asked["cores"].get<size_t>(),
      asked["cores"] == 1 ? "" : "s", asked["speed"].get<double>(), asked["policy"].get<std::string>(),
      is["duration_s"].get<double>(), asked["record"].get<std::string>(), was["clock"].get<std::string>(),
      was["policy_asked"].get<std::string>(), was["schedule"].get<std::string>());
  const auto row = [](const char* format, auto... words) { return fmt::format(fmt::runtime(format), words...); };
  text += fmt::format("{:<16} {:>11} {:>9} {:>35}\n", "", "jobs", "misses", "response, ms");
  text += row(kNodeRow, "node", "rec", "pred", "rec", "pred", "p50", "pred", "p99", "pred", "max", "pred");
  for (size_t i = 0; i < is["nodes"].size(); ++i) text += node_line(was["nodes"][i], is["nodes"][i]);
  if (!is["chains"].empty())
    text += "\n" + row(kChainRow, "chain: age, ms", "p50", "pred", "p99", "pred", "max", "pred", "bound", "verdict");
  for (size_t i = 0; i < is["chains"].size(); ++i) text += chain_line(was["chains"][i], is["chains"][i]);
  text += fmt::format("\nCPU {:.2f} cores in jobs\n", is["cpu"]["utilisation"].get<double>());
  for (const Json& line : is["adjusted"]) text += "adjusted: " + line.get<std::string>() + "\n";
  return text + doubts_text(asked) + verdict_text(comparison);
}

}  // namespace takt::what_if
