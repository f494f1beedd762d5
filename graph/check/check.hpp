// SPDX-License-Identifier: Apache-2.0
// What can be known of a composed graph before it starts.
#pragma once
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "graph/language/graph.hpp"
#include "rt/node.hpp"
#include "rt/sched/plan.hpp"

namespace takt::graph {

/// Load and memory of a plan. Utilisation is sum(budget * rate) over the cores of the schedule; response times are not
/// analysed yet, so `admitted` says that the work fits on average, not that every deadline is proven.
struct CheckResult {
  bool admitted = false;
  double utilisation = 0;  ///< cores wanted
  size_t cores = 0;
  uint64_t pool_bytes = 0;
  std::vector<std::string> unbudgeted;  ///< tasks whose budget is not stated: not counted
  std::string text;                     ///< table for people, the reason first if not admitted
  nlohmann::ordered_json json;
};

CheckResult check(const GraphSpec& graph, const Plan& plan);

/// `takt nodes`: every type with its layer and purpose.
std::string nodes_text(const NodeTypes& types);
/// `takt nodes TYPE`: ports with message types, parameters with default, unit, range and meaning.
std::string node_text(const NodeType& type);

}  // namespace takt::graph
