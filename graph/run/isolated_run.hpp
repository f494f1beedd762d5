// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "graph/run/faults.hpp"
#include "graph/run/run.hpp"

namespace takt::command {

/// Supervises a run with one process for the devices and one per subsystem: owns the transport (over iceoryx with its
/// daemon), the epoch, the report, and the order in which everything ends; returns the exit code. Before this process
/// has any other thread. Throws TransportError if the command line asks for iceoryx and there is no room for its
/// daemon.
int run_isolated(const Registry& registry, const RunOptions& options, const graph::GraphSpec& graph, RunFaults& faults,
                 std::vector<std::string> adjusted);

}  // namespace takt::command
