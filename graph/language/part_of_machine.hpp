// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "graph/language/graph.hpp"

namespace takt::graph {

/// The process of a machine that talks to the others, and to which their devices belong.
inline constexpr const char* kLinkProcess = "link";

/// What one machine runs of a graph for several. Outputs of others that it reads become devices with the id of the node
/// or device that makes them there (DeviceSpec::remote); each other machine is a device, too, which is there or lost.
/// Such a device has twice the rate of what it stands for: clocks drift, and no message must wait until a second one is
/// there. What speaks of nodes that are not here is left out; `adjusted` names chains.
GraphSpec part_of_machine(GraphSpec graph, const std::string& machine);

/// Devices and nodes, producers before consumers as far as edges form no cycle, requests aside: set up in this order,
/// on however many machines, nobody waits for the sizes of one who waits for him.
std::vector<std::string> setup_order(const GraphSpec& graph);

/// The whole graph on one machine: none can be lost.
void run_on_one_machine(GraphSpec& graph);

}  // namespace takt::graph
