// SPDX-License-Identifier: Apache-2.0
#include "graph/faults/scenario.hpp"

#include <algorithm>

namespace takt::graph {
namespace {

constexpr const char* kDevices = "devices";

}  // namespace

int64_t FaultSpec::begins_ns() const {
  const bool instant = kind == FaultKind::hang || strikes_processes(kind);
  return instant && every_ns == 0 ? at_ns : from_ns;
}

int64_t FaultSpec::ends_ns() const {
  if (kind == FaultKind::hang) return for_ns == 0 ? faults::kForever : at_ns + for_ns;
  if (strikes_processes(kind) && every_ns > 0) return to_ns + for_ns;
  if (strikes_processes(kind)) return at_ns + for_ns;
  return to_ns;
}

std::vector<DeviceFailure> device_failures(const Scenario& scenario) {
  std::vector<DeviceFailure> failures;
  for (const FaultSpec& fault : scenario.faults)
    if (info(fault.kind).target == FaultTarget::device)
      failures.push_back({fault.target, fault.kind, fault.from_ns, fault.to_ns});
  return failures;
}

std::vector<std::string> processes_of(const GraphSpec& graph) {
  std::vector<std::string> names;
  if (!graph.devices.empty()) names.emplace_back(kDevices);
  for (const SubsystemSpec& subsystem : graph.subsystems) names.push_back(subsystem.name);
  return names;
}

std::string process_of(const GraphSpec& graph, const std::string& id) {
  for (const std::string& name : processes_of(graph))
    if (name == id) return name;
  for (const NodeSpec& node : graph.nodes)
    if (node.id == id) return node.subsystem;
  for (const DeviceSpec& device : graph.devices)
    if (device.id == id) return kDevices;
  return "";
}

}  // namespace takt::graph
