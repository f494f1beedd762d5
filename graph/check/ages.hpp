// SPDX-License-Identifier: Apache-2.0
// Age bounds of a plan: of every chain at its end, of every edge with a `max_age` where a job takes its message.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "graph/check/admission.hpp"
#include "graph/language/graph.hpp"

namespace takt::graph {

struct AgeBound {
  std::string name;  ///< of the chain, or "producer.port -> consumer.input"
  bool edge = false;
  int64_t max_age_ns = 0;
  std::optional<int64_t> bound_ns;   ///< of data that every job took as the newest of its messages
  std::optional<int64_t> oldest_ns;  ///< of the oldest of the `depth` messages taken
  int64_t least_ns = 0;              ///< no execution of this schedule stays below
  std::string why;                   ///< why there is no bound
  bool reached = true;               ///< a path from a device leads there
  bool possible() const { return least_ns <= max_age_ns; }
  bool proven() const { return bound_ns && *bound_ns <= max_age_ns; }
};

/// Stamps come from devices and go along the data edges (not `control`, nor what an output is not stamped by); where
/// several paths lead to a place the worst counts. `nodes`: what the admission of the same plan found. Every job must
/// publish: a node that is paced or paused by requests lets its readers' data grow older than this. A plan that lacks
/// nodes of the graph is that of a mode: what is not reached without them has no age to keep.
std::vector<AgeBound> age_bounds(const GraphSpec& graph, const Plan& plan, const std::vector<NodeAdmission>& nodes);

}  // namespace takt::graph
