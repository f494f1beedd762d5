// SPDX-License-Identifier: Apache-2.0
#include "graph/compose/spares.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <set>

#include "rt/sched/lane.hpp"
#include "rt/sched/lane_tasks.hpp"

namespace takt::graph {
namespace {

std::set<std::string> producers_of(const GraphSpec& graph, const std::string& id) {
  std::set<std::string> producers;
  const auto add = [&](const auto& specs) {
    for (const auto& spec : specs)
      if (spec.id == id)
        for (const EdgeSpec& edge : spec.edges) producers.insert(edge.from.node);
  };
  add(graph.nodes);
  add(graph.devices);
  return producers;
}

/// Nodes and devices on a path of the chain, ends included.
std::set<std::string> on_chain(const GraphSpec& graph, const ChainSpec& chain) {
  std::set<std::string> on{chain.from.node};
  // A node is on a path if it leads to the end and one of its producers is on a path.
  std::set<std::string> before{chain.to.node};
  for (size_t known = 0; known != before.size();) {
    known = before.size();
    for (const std::string& id : std::set(before))
      if (id != chain.from.node) before.merge(producers_of(graph, id));
  }
  for (size_t known = 0; known != on.size();) {
    known = on.size();
    for (const std::string& id : before) {
      const std::set<std::string> producers = producers_of(graph, id);
      if (std::any_of(producers.begin(), producers.end(), [&](const std::string& p) { return on.contains(p); }))
        on.insert(id);
    }
  }
  return on;
}

bool is_high(const GraphSpec& graph, const std::string& id) {
  const auto entry = graph.schedule.entries.find(id);
  return entry != graph.schedule.entries.end() && entry->second.criticality == Criticality::high;
}

/// Of the process's subsystems; one that was merged into another process counts there.
std::optional<bool> asked_for(const GraphSpec& graph, const Partition& partition, size_t process) {
  std::optional<bool> asked;
  for (const NodeSpec& node : graph.nodes)
    for (const SubsystemSpec& subsystem : graph.subsystems)
      if (subsystem.name == node.subsystem && partition.process_of.at(node.id) == process && subsystem.spare)
        asked = asked.value_or(false) || *subsystem.spare;
  return asked;
}

}  // namespace

std::vector<SpareChoice> spares(const GraphSpec& graph, const Partition& partition,
                                std::vector<std::string>& adjusted) {
  std::vector<SpareChoice> choices(partition.names.size());
  for (const ChainSpec& chain : graph.chains) {
    if (chain.max_age_ns >= kReturn_ns || !is_high(graph, chain.to.node)) continue;
    for (const std::string& id : on_chain(graph, chain)) {
      SpareChoice& choice = choices[partition.process_of.at(id)];
      choice.wanted = true;
      choice.why = fmt::format("chain {} allows {:.0f} ms, a return without a spare takes {:.0f}", chain.name,
                               static_cast<double>(chain.max_age_ns) * 1e-6, static_cast<double>(kReturn_ns) * 1e-6);
    }
  }
  for (size_t p = 0; p < choices.size(); ++p) {
    const std::optional<bool> asked = asked_for(graph, partition, p);
    if (asked) choices[p] = {*asked, "the graph says so"};
    else if (!choices[p].wanted)
      choices[p].why = fmt::format("no chain to a node of high criticality needs it back within {:.0f} ms",
                                   static_cast<double>(kReturn_ns) * 1e-6);
    const auto device = std::find_if(graph.devices.begin(), graph.devices.end(),
                                     [&](const DeviceSpec& d) { return partition.process_of.at(d.id) == p; });
    if (device == graph.devices.end()) continue;
    if (asked.value_or(false))
      adjusted.push_back(fmt::format("spare of process {} -> none: it owns device {}, which cannot be opened twice",
                                     partition.names[p], device->id));
    choices[p] = {false, fmt::format("it owns device {}", device->id)};
  }
  return choices;
}

std::vector<TakeoverRoom> takeover_room(const Plan& plan, const Partition& partition, double limit) {
  if (plan.policy != Policy::deadline) return {};
  std::vector<TakeoverRoom> room(partition.names.size());
  const std::vector<std::vector<size_t>> lanes = lane_members(plan);
  const std::vector<Reservation> wanted = reservations(plan, plan.policy);
  double reserved = 0;
  for (size_t i = 0; i < lanes.size(); ++i) {
    const double share = static_cast<double>(wanted[i].runtime_ns) / static_cast<double>(wanted[i].period_ns);
    room[partition.process_of.at(plan.tasks[lanes[i].front()].name)].needs += share;
    reserved += share;
  }
  for (TakeoverRoom& of : room) of.free = std::max(0.0, limit - reserved);
  return room;
}

std::string spares_text(const Partition& partition, const std::vector<SpareChoice>& choices,
                        const std::vector<TakeoverRoom>& room) {
  const auto told = [&](size_t p) {
    return fmt::format("needs {:.3f} cores beside those of the dead, {:.3f} are free", room[p].needs, room[p].free);
  };
  std::string text;
  size_t largest = choices.size();
  for (size_t p = 0; p < choices.size(); ++p) {
    if (choices[p].wanted)
      text += fmt::format("spare of process {}: {}{}\n", partition.names[p], choices[p].why,
                          room.empty() ? "" : "; its takeover " + told(p));
    else if (!room.empty() && !room[p].fits() && (largest == choices.size() || room[p].needs > room[largest].needs))
      largest = p;
  }
  if (largest < choices.size())
    text += fmt::format("a return of process {} {}: its jobs run under SCHED_FIFO meanwhile\n",
                        partition.names[largest], told(largest));
  return text;
}

nlohmann::ordered_json spares_json(const Partition& partition, const std::vector<SpareChoice>& choices,
                                   const std::vector<TakeoverRoom>& room) {
  auto json = nlohmann::ordered_json::array();
  for (size_t p = 0; p < choices.size(); ++p) {
    json.push_back({{"process", partition.names[p]}, {"spare", choices[p].wanted}, {"why", choices[p].why}});
    if (!room.empty()) json.back().update({{"needs_cores", room[p].needs}, {"free_cores", room[p].free}});
  }
  return json;
}

}  // namespace takt::graph
