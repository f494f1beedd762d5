// SPDX-License-Identifier: Apache-2.0
// From the checked graph to something that can run: devices and nodes made and set up, ports sized, the plan filled in.
#pragma once
#include <functional>
#include <memory>
#include <vector>

#include "graph/language/graph.hpp"
#include "rt/node.hpp"
#include "rt/sched/plan.hpp"

namespace takt::graph {

/// Why a graph could not be composed. `device_failed` tells a broken device (exit 3) from bad input (exit 2).
struct ComposeError {
  std::vector<Problem> problems;
  bool device_failed = false;
};

/// Makes the hardware node of a device entry.
using DeviceFactory = std::function<tl::expected<std::unique_ptr<Node>, ComposeError>(const DeviceSpec&)>;

struct ComposeOptions {
  std::filesystem::path output;  ///< where nodes may write files at the end
  uint64_t seed = 1;
};

/// Nodes in the order of the plan's tasks; the plan points into them.
struct Composition {
  std::vector<std::unique_ptr<Node>> nodes;
  Plan plan;
  std::vector<std::string> edge_names_from, edge_names_to;  ///< per edge, in task and edge order
};

tl::expected<Composition, ComposeError> compose(const GraphSpec& graph, const NodeTypes& types,
                                                const DeviceFactory& make_device, const Clock& clock,
                                                const ComposeOptions& options);

/// All node types this build knows.
NodeTypes node_types();

}  // namespace takt::graph
