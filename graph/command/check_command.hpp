// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "graph/run/run.hpp"

namespace takt::command {

/// `takt check`: 0 admitted, 1 infeasible, 2 invalid. Opens the devices' files but starts nothing.
int check_graph(const Registry& registry, const RunOptions& options, bool json);
/// `takt nodes [TYPE]`.
int print_nodes(const Registry& registry, const std::string& type);

}  // namespace takt::command
