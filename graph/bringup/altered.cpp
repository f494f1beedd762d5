// SPDX-License-Identifier: Apache-2.0
#include "graph/bringup/altered.hpp"

#include <algorithm>

namespace takt::bringup {

void leave_only(graph::GraphSpec& graph, const std::string& device) {
  std::erase_if(graph.devices, [&](const graph::DeviceSpec& other) { return other.id != device; });
  for (graph::DeviceSpec& left : graph.devices) left.edges.clear();
  graph.nodes.clear(), graph.subsystems.clear(), graph.chains.clear(), graph.modes.clear();
  graph.expect.reset();
  graph.record.ports.clear(), graph.record.freeze.clear();
  std::erase_if(graph.schedule.entries, [&](const auto& entry) { return entry.first != device; });
}

void drive_by_hand(graph::GraphSpec& graph, const std::string& base) {
  const auto device =
      std::find_if(graph.devices.begin(), graph.devices.end(), [&](const auto& d) { return d.id == base; });
  if (device == graph.devices.end()) return;
  std::erase_if(device->edges, [](const graph::EdgeSpec& edge) { return edge.input == "velocity"; });
  graph::EdgeSpec edge;
  edge.from = {kDriver, "velocity"};
  edge.input = "velocity";
  edge.max_age_ns = 300'000'000;
  edge.position = device->position;
  device->edges.push_back(edge);
  graph::NodeSpec node;
  node.id = kDriver;
  node.type = "cruise";
  node.subsystem = "bringup";
  node.params["speed"] = {0.0, device->position};
  node.position = device->position;
  graph.nodes.push_back(node);
  graph.subsystems.push_back({"bringup", {{kDriver, "velocity"}}, device->position});
  graph::ScheduleEntry entry = graph.schedule.entries[base];
  entry.on.reset();
  if (!entry.rate) entry.rate = device->rate;
  entry.offset_ns = 0, entry.deadline_ns = 0, entry.budget_ns = 1'000'000;
  entry.core = -1;
  graph.schedule.entries[kDriver] = entry;
}

}  // namespace takt::bringup
