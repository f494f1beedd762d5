// SPDX-License-Identifier: Apache-2.0
#include "graph/command/top/watched.hpp"

#include <algorithm>

#include "graph/attach/parameters.hpp"

namespace takt::top {
namespace {

constexpr size_t kBoardJobs = 63;  ///< what JobsSince takes of a node at one look, at most

std::optional<double> number(const Json& of, const char* key) {
  const auto found = of.find(key);
  return found == of.end() || found->is_null() ? std::nullopt : std::optional(found->get<double>());
}

void take_node(const Json& state, NodeSeen& node) {
  node.completed = state.at("completed");
  node.deadline_misses = state.at("deadline_misses");
  node.skipped = state.at("skipped");
  node.paused = state.at("paused");
  node.overruns = state.at("overruns");
  node.level = state.at("level");
  node.exec_ms = state.at("exec_ms");
  node.response_ms = state.at("response_ms");
  node.response_max_ms = state.at("response_max_ms");
}

void take_state(const Json& state, Watched& run) {
  run.heard = true;
  run.running_s = state.at("running_s");
  run.mode = state.at("mode");
  for (size_t n = 0; n < run.nodes.size(); ++n) take_node(state.at("nodes").at(n), run.nodes[n]);
  for (size_t c = 0; c < run.chains.size(); ++c) {
    run.chains[c].age_ms = number(state.at("chains").at(c), "age_ms");
    run.chains[c].age_max_ms = number(state.at("chains").at(c), "age_max_ms");
  }
  run.devices.clear();
  for (const Json& device : state.at("devices"))
    run.devices.push_back({device.at("name"), device.at("state"), device.value("trouble", ""), device.at("losses"),
                           device.at("received"), device.at("damaged"), device.at("resyncs"), device.at("missing"),
                           device.value("unsent", uint64_t{0})});
  run.processes.clear();
  for (const Json& process : state.at("processes"))
    run.processes.push_back(
        {process.at("name"), process.at("state"), process.at("pid"), process.at("restarts"), std::nullopt, 0.0});
  run.parameters.clear();
  for (const Json& parameter : state.at("parameters")) run.parameters.push_back(attach::parameter_text(parameter));
}

void take_jobs(const Json& jobs, Watched& run) {
  std::vector<size_t> count(run.nodes.size(), 0);
  for (const Json& job : jobs) {
    const size_t n = job.at(0);
    if (n >= run.nodes.size()) continue;
    run.nodes[n].jobs.push_back({job.at(1), job.at(2), job.at(3)});
    ++count[n];
  }
  for (size_t n = 0; n < run.nodes.size(); ++n) {
    NodeSeen& node = run.nodes[n];
    if (count[n] >= kBoardJobs) node.jobs_unseen = true;
    while (!node.jobs.empty() && node.jobs.front().finish_s < run.running_s - kHistory_s) node.jobs.pop_front();
  }
}

void take_events(const Json& events, Watched& run) {
  for (const Json& event : events)
    run.events.push_back(
        {event.at("at_s"), event.at("kind"), event.value("node", ""), event.at("text"), event.value("level", "")});
  for (; run.events.size() > kMostEvents; ++run.events_left_out) run.events.pop_front();
}

}  // namespace

Watched watched(const Json& description) {
  Watched run;
  run.graph = description.at("name");
  run.profile = description.at("profile");
  run.policy = description.at("policy");
  run.pid = description.at("pid");
  for (const Json& node : description.at("nodes")) {
    NodeSeen& seen = run.nodes.emplace_back();
    seen.name = node.at("name");
    seen.process = node.at("process");
    seen.criticality = node.at("criticality");
    seen.device = node.at("device");
    seen.rate_hz = number(node, "rate_hz");
    seen.budget_ms = number(node, "budget_ms");
    seen.proven_ms = number(node, "proven_ms");
    seen.deadline_ms = node.at("deadline_ms");
    seen.levels = node.at("levels");
  }
  for (const Json& chain : description.at("chains"))
    run.chains.push_back({chain.at("name"), chain.at("from"), chain.at("to"), chain.at("bound_ms"),
                          number(chain, "proven_ms"), std::nullopt, std::nullopt});
  return run;
}

void take(const Json& line, Watched& run) {
  if (!line.contains("state")) return;
  take_state(line.at("state"), run);
  take_jobs(line.at("jobs"), run);
  take_events(line.at("events"), run);
}

void take_use(const attach::MachineUse::Use& use, Watched& run) {
  run.use = use;
  for (size_t p = 0; p < std::min(run.processes.size(), use.processes.size()); ++p) {
    run.processes[p].cpu = use.processes[p].cpu;
    run.processes[p].own_mb = use.processes[p].own_mb;
  }
}

}  // namespace takt::top
