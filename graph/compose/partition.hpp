// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <map>
#include <string>
#include <vector>

#include "graph/language/graph.hpp"

namespace takt::graph {

/// Which process runs what: one for all devices, one per subsystem (thesis Sec. 2.2). A node released by the output of
/// another process would need a wake-up across it, so the two processes become one; `adjusted` says so.
struct Partition {
  std::vector<std::string> names;            ///< processes, in the order of the file
  std::map<std::string, size_t> process_of;  ///< by node or device id
};

Partition partition(const GraphSpec& graph, std::vector<std::string>& adjusted);

}  // namespace takt::graph
