// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "graph/command/run_command.hpp"

namespace takt::command {

/// How a run in several processes ended, or why there can be none on this machine (nothing was started then).
struct IsolatedEnd {
  int code = 0;
  std::string not_isolated;
};

/// Supervises a run with one process for the devices and one per subsystem: owns the iceoryx daemon, the epoch, the
/// report, and the order in which everything ends. Before this process has any other thread.
IsolatedEnd run_isolated(const RunOptions& options, const graph::GraphSpec& graph, std::vector<std::string> adjusted);

}  // namespace takt::command
