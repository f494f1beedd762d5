// SPDX-License-Identifier: Apache-2.0
#include "graph/run/report.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "graph/attach/parameters.hpp"
#include "graph/cli/boundary.hpp"
#include "graph/explain/file_format.hpp"
#include "rt/abi.hpp"

namespace takt::command {
namespace {

using Json = nlohmann::ordered_json;
constexpr uint64_t kSamplesForP999 = 1000;

/// [[upper edge, samples], ...] with edges at 1, 2, 5 of each decade: what a picture needs.
Json coarse_histogram(const Histogram& h) {
  Json bars = Json::array();
  double edge_us = 1;
  uint64_t samples = 0;
  int step = 0;
  const auto close = [&] {
    if (samples > 0) bars.push_back({edge_us, samples});
    samples = 0;
    edge_us *= step++ % 3 == 1 ? 2.5 : 2;
  };
  h.for_each([&](int64_t upper_ns, uint64_t count) {
    while (static_cast<double>(upper_ns) * 1e-3 > edge_us) close();
    samples += count;
  });
  if (samples > 0) close();
  return bars;
}

Json grant_json(const Grant& grant) {
  return {{"policy", to_string(grant.policy)},
          {"runtime_ms", grant.runtime_ms},
          {"deadline_ms", grant.deadline_ms},
          {"priority", grant.priority},
          {"cpus", grant.cpus},
          {"verified", grant.verified}};
}

/// Jobs by level, and since when each of the last changes held.
void add_quality(Json& json, const Node& node, const TaskStatistics& s, int64_t epoch_ns) {
  json["quality"] = Json::object();
  for (size_t l = 0; l < node.levels().size(); ++l) {
    json["quality"][std::to_string(l)] = s.at_level[l].load();
    json["quality_levels"].push_back(node.levels()[l].name);
  }
  const uint64_t count = s.level_changes.load(), kept = std::min<uint64_t>(count, s.changes.size());
  json["quality_changes"] = {{"count", count}, {"last", Json::array()}};
  for (uint64_t n = count - kept; n < count; ++n) {
    const LevelChange& change = s.changes[n % s.changes.size()];
    json["quality_changes"]["last"].push_back(
        {{"at_s", static_cast<double>(change.release_ns - epoch_ns) / 1e9}, {"level", change.level}});
  }
}

double cores_of(const RunFacts& facts, size_t t) {
  return static_cast<double>(facts.board.task(t).cpu_ns) / std::max(1.0, facts.result.duration_s() * 1e9);
}

/// Of a figure for which something was proven, or could have been.
Json distribution_beside(const Histogram& h, double ns_per_unit, const Json& beside_max) {
  Json json = distribution(h, ns_per_unit);
  json.update(beside_max);
  return json;
}

Json node_json(const RunFacts& facts, const ProofReport& proofs, size_t t) {
  const TaskPlan& plan = facts.plan.tasks[t];
  const TaskStatistics& s = facts.board.task(t);
  Json node;
  node["name"] = plan.name;
  node["rate_hz"] = plan.rate ? Json(plan.rate->hz()) : Json(nullptr);
  const uint64_t paused =
      s.paused.load() + left_out_jobs(facts.plan, facts.board, t, facts.result.epoch_ns, facts.result.end_ns);
  const double paused_s = plan.rate ? static_cast<double>(paused) / plan.rate->hz() : 0;
  node["active_s"] = std::max(0.0, facts.result.duration_s() - paused_s);
  node["criticality"] = to_string(plan.criticality);
  node["device"] = plan.device;
  node["released"] = facts.result.released[t];
  for (const auto& [key, counter] : std::initializer_list<std::pair<const char*, const std::atomic<uint64_t>*>>{
           {"completed", &s.completed},
           {"skipped", &s.skipped},
           {"reused", &s.reused},
           {"deadline_misses", &s.deadline_misses},
           {"budget_overruns", &s.budget_overruns},
           {"stale_inputs", &s.stale_inputs},
           {"demoted", &s.demoted},
           {"lifted", &s.lifted},
           {"new_inputs", &s.new_inputs},
           {"no_result", &s.no_result}})
    node[key] = counter->load();
  node["paused"] = paused;
  node["log"] = {{"lines", facts.board.log(t).size()}, {"dropped", facts.board.log(t).dropped()}};
  node["enforcement_error_us"] =
      s.demoted.load() > 0 ? Json(static_cast<double>(s.enforcement_error_ns.load()) / 1e3) : Json(nullptr);
  node["drift_us"] = s.drift_us();
  add_quality(node, *plan.node, s, facts.result.epoch_ns);
  node["granted"] = grant_json(facts.board.grant(t));
  node["lateness_us"] = distribution(s.lateness, 1e3);
  node["lateness_histogram_us"] = coarse_histogram(s.lateness);
  node["exec_ms"] = distribution(s.exec, 1e6);
  node["response_ms"] = distribution_beside(s.response, 1e6, proofs.of_response(t));
  node["publish_ms"] = distribution(s.publish, 1e6);
  node["cores"] = cores_of(facts, t);
  node["preempted_ms"] = static_cast<double>(s.preempted_ns) / 1e6;
  node["samples"] = s.exec.count();
  node["allocations"] = s.allocations;
  node["page_faults"] = s.page_faults;
  node["rt_violations"] = violations_json(s);
  return node;
}

Json edges_json(const RunFacts& facts, const ProofReport& proofs) {
  Json edges = Json::array();
  for (size_t t = 0; t < facts.plan.tasks.size(); ++t) {
    const TaskPlan& task = facts.plan.tasks[t];
    for (size_t e = 0; e < task.edges.size(); ++e) {
      const PortPlan& port = facts.plan.ports[task.edges[e].port];
      const EdgeStatistics& s = facts.board.edge(t, e);
      edges.push_back({{"from", port.node + "." + port.port},
                       {"to", task.name + "." + std::string(task.node->inputs()[task.edges[e].input]->name())},
                       {"sent", facts.board.port(task.edges[e].port).writer.sent},
                       {"received", s.received},
                       {"dropped", s.dropped},
                       {"stale", s.stale.load()},
                       {"damaged", s.damaged},
                       {"passed_over", s.passed_over.load()},
                       {"exhausted", facts.board.port(task.edges[e].port).writer.pool_empty},
                       {"age_ms", distribution_beside(s.age, 1e6, proofs.of_edge(t, e))}});
    }
  }
  return edges;
}

Json pools_json(const RunFacts& facts) {
  Json pools = Json::array();
  for (size_t p = 0; p < facts.plan.ports.size(); ++p) {
    const PortPlan& port = facts.plan.ports[p];
    const WriterStatistics& s = facts.board.port(p).writer;
    pools.push_back({{"port", port.node + "." + port.port},
                     {"bytes", port.chunk_bytes()},
                     {"chunks", s.chunks},
                     {"peak", s.peak_in_use},
                     {"in_use_at_end", s.in_use},
                     {"exhausted", s.pool_empty}});
  }
  return pools;
}

/// The jobs of the last whole second before the end.
Json timeline_json(const RunFacts& facts) {
  constexpr int64_t kSecond = 1'000'000'000;
  const int64_t begin = std::max(facts.result.epoch_ns, facts.result.end_ns - kSecond);
  const auto ms = [&](int64_t ns) { return static_cast<double>(ns - begin) / 1e6; };
  Json timeline = Json::array();
  for (size_t t = 0; t < facts.plan.tasks.size(); ++t) {
    const TaskStatistics& s = facts.board.task(t);
    const uint64_t count = s.job_count.load(), kept = std::min<uint64_t>(count, s.jobs.size());
    for (uint64_t n = count - kept; n < count; ++n) {
      const JobRecord& job = s.jobs[n % s.jobs.size()];
      if (job.release_ns < begin || job.release_ns >= facts.result.end_ns) continue;
      timeline.push_back({{"node", facts.plan.tasks[t].name},
                          {"cpu", job.cpu},
                          {"release_ms", ms(job.release_ns)},
                          {"start_ms", ms(job.start_ns)},
                          {"finish_ms", ms(job.finish_ns)}});
    }
  }
  return timeline;
}

Json cpu_json(const RunFacts& facts) {
  int64_t nodes = 0, devices = 0;
  for (size_t t = 0; t < facts.plan.tasks.size(); ++t)
    (facts.plan.tasks[t].device ? devices : nodes) += facts.board.task(t).cpu_ns;
  devices -= std::min(devices, facts.use.simulator_in_jobs_ns);
  const auto total = static_cast<double>(facts.use.cpu_ns);
  const double wall = std::max(1.0, facts.result.duration_s() * 1e9);
  const auto share = [&](double ns) { return ns / wall; };
  const auto simulator = static_cast<double>(facts.use.simulator_cpu_ns);
  const double runtime = std::max(0.0, total - static_cast<double>(nodes + devices) - simulator);
  return {{"utilisation", share(total)},
          {"by",
           {{"nodes", share(static_cast<double>(nodes))},
            {"devices", share(static_cast<double>(devices))},
            {"simulator", share(simulator)},
            {"runtime", share(runtime)}}}};
}

/// Age of what the node publishes on an output, at that instant, or of what its jobs have of an input; null if the mode
/// leaves the node out.
const Histogram* age_at(const RunFacts& facts, const graph::PortName& name) {
  for (size_t p = 0; p < facts.plan.ports.size(); ++p)
    if (facts.plan.ports[p].node == name.node && facts.plan.ports[p].port == name.port) return &facts.board.port(p).age;
  for (size_t t = 0; t < facts.plan.tasks.size(); ++t)
    for (size_t e = 0; e < facts.plan.tasks[t].edges.size(); ++e) {
      const TaskPlan& task = facts.plan.tasks[t];
      if (task.name == name.node && task.node->inputs()[task.edges[e].input]->name() == name.port)
        return &facts.board.edge(t, e).age;
    }
  return nullptr;
}

Json chains_json(const RunFacts& facts, const ProofReport& proofs) {
  Json chains = Json::array();
  for (const graph::ChainSpec& chain : facts.graph.chains) {
    const Histogram* age = age_at(facts, chain.to);
    const bool sampled = age != nullptr && age->count() > 0;
    const Json proven = proofs.of_chain(chain.name);
    chains.push_back({{"name", chain.name},
                      {"age_ms", distribution_beside(sampled ? *age : Histogram(), 1e6, proven)},
                      {"bound_ms", static_cast<double>(chain.max_age_ns) / 1e6},
                      {"proven_ms", proven["proven_ms"]},
                      {"within", sampled ? Json(age->max_ns() <= chain.max_age_ns) : Json(nullptr)}});
  }
  return chains;
}

bool kept_its_promises(const Json& nodes) {
  return std::all_of(nodes.begin(), nodes.end(), [](const Json& node) {
    const bool missed = node["criticality"] == "high" && node["deadline_misses"].get<uint64_t>() > 0;
    const bool fell_behind =
        !node["rate_hz"].is_null() && node["completed"].get<uint64_t>() + 1 < node["released"].get<uint64_t>();
    return !missed && !fell_behind;
  });
}

}  // namespace

Json distribution(const Histogram& h, double ns_per_unit) {
  const auto figure = [&](int64_t ns) {
    return h.count() ? Json(static_cast<double>(ns) / ns_per_unit) : Json(nullptr);
  };
  return {{"p50", figure(h.quantile_ns(0.5))},
          {"p99", figure(h.quantile_ns(0.99))},
          {"p999", h.count() >= kSamplesForP999 ? figure(h.quantile_ns(0.999)) : Json(nullptr)},
          {"max", figure(h.max_ns())}};
}

Json make_report(const RunFacts& facts) {
  Json nodes = Json::array();
  const ProofReport proofs(
      {facts.graph, facts.plan, facts.board, facts.proofs, facts.stalls, facts.result, facts.clock == "virtual"});
  for (size_t t = 0; t < facts.plan.tasks.size(); ++t) nodes.push_back(node_json(facts, proofs, t));
  Json report;
  report["format"] = explain::kReportFormat;
  report["graph"] = facts.graph.name;
  report["schedule"] = facts.graph.schedule.name;
  report["profile"] = facts.graph.profile;
  report["clock"] = facts.clock;
  report["policy_asked"] = facts.policy_asked;
  report["policy_granted"] = to_string(facts.result.policy_granted);
  if (facts.clock == "real" && facts.plan.anticipate_ns > 0)
    report["anticipate_us"] = static_cast<double>(facts.plan.anticipate_ns) / 1e3;
  report["duration_s"] = facts.result.duration_s();
  report["commit"] = version().commit;
  report["machine"] = machine_facts();
  if (!facts.graph.machine.empty()) report["unauthenticated"] = facts.graph.network.keys.empty();
  report["ok"] = kept_its_promises(nodes) && !proofs.unexplained();
  report["modes"] = modes_json(facts);
  report["transport"] = facts.transport.name();
  report["isolation"] = facts.isolation;
  report["processes"] = facts.processes;
  report["parameters"] = attach::parameters_json(facts.registry.nodes, facts.graph, facts.plan, facts.board);
  report["overlay"] = facts.graph.kept.file.empty() ? Json(nullptr) : Json(facts.graph.kept.file.string());
  report["proofs"] = proofs.json();
  report["nodes"] = std::move(nodes);
  report["devices"] = devices_json(facts);
  report["edges"] = edges_json(facts, proofs);
  report["chains"] = chains_json(facts, proofs);
  report["memory"] = {{"shm_mb", static_cast<double>(facts.transport.shared_memory_bytes()) / 1e6},
                      {"rss_mb", facts.use.rss_mb},
                      {"board_mb", static_cast<double>(facts.board.bytes()) / 1e6},
                      {"pools", pools_json(facts)}};
  report["cpu"] = cpu_json(facts);
  report["host_stall_ms"] = facts.use.steal_ms;
  report["recorder_lost"] = 0;  // RunRecord::tell knows better
  report["unsaid_lines"] = unsaid_lines();
  report["adjusted"] = facts.adjusted;
  report["faults"] = faults_json(facts);
  report["timeline"] = timeline_json(facts);
  return report;
}

}  // namespace takt::command
