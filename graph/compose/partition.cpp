// SPDX-License-Identifier: Apache-2.0
#include "graph/compose/partition.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "graph/language/part_of_machine.hpp"

namespace takt::graph {
namespace {

constexpr const char* kDevices = "devices";

/// Home of every id before anything is merged: a subsystem's name, or "devices".
std::map<std::string, std::string> homes_of(const GraphSpec& graph) {
  std::map<std::string, std::string> homes;
  for (const DeviceSpec& device : graph.devices) homes[device.id] = device.remote ? kLinkProcess : kDevices;
  for (const NodeSpec& node : graph.nodes) homes[node.id] = node.subsystem;
  return homes;
}

void move_all(std::map<std::string, std::string>& homes, const std::string& from, const std::string& to) {
  for (auto& [id, home] : homes)
    if (home == from) home = to;
}

}  // namespace

Partition partition(const GraphSpec& graph, std::vector<std::string>& adjusted) {
  std::map<std::string, std::string> homes = homes_of(graph);
  for (const auto& [id, entry] : graph.schedule.entries) {
    if (!entry.on || !homes.contains(id) || !homes.contains(entry.on->node)) continue;
    const std::string from = homes[id], to = homes[entry.on->node];
    if (from == to) continue;
    adjusted.push_back(
        fmt::format("process {} -> {}: {} runs on {}, and a lane is never split", from, to, id, entry.on->text()));
    move_all(homes, from, to);
  }
  Partition result;
  const auto place = [&](const std::string& id) {
    const std::string& home = homes[id];
    const auto known = std::find(result.names.begin(), result.names.end(), home);
    result.process_of[id] = static_cast<size_t>(known - result.names.begin());
    if (known == result.names.end()) result.names.push_back(home);
  };
  for (const DeviceSpec& device : graph.devices) place(device.id);
  for (const NodeSpec& node : graph.nodes) place(node.id);
  return result;
}

}  // namespace takt::graph
