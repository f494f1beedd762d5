// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "graph/compose/partition.hpp"
#include "graph/language/graph.hpp"

namespace takt::graph {

/// Whether a process of a run has a spare: a second process with its part composed, which takes its place when it dies.
struct SpareChoice {
  bool wanted = false;
  std::string why;  ///< "chain stop (200 ms) allows less than the 0.5 s that a return takes without one"
};

/// How long a process is away without a spare, from kill to first publication: what its readers' ages must allow.
inline constexpr int64_t kReturn_ns = 300'000'000;

/// By process of the partition. A process has a spare where its subsystem says so (`spare`), by default where it lies
/// on a chain that ends in a node of high criticality and allows less than kReturn_ns. One that owns devices never has:
/// they cannot be opened twice; where one was asked for, `adjusted` says so.
std::vector<SpareChoice> spares(const GraphSpec& graph, const Partition& partition, std::vector<std::string>& adjusted);

}  // namespace takt::graph
