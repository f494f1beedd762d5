// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <CLI/CLI.hpp>

#include "graph/flight/pull.hpp"

namespace takt::command {

struct LogPullOptions {
  flight::PullOptions pull;
  bool json = false;
};

/// `takt log pull HOST:FOLDER -o DIR`: the frozen files of a robot. Exit 0, 1 if it was interrupted or something that
/// came is not what was sent, 2 if there is no such folder, 3 if the robot cannot be reached or there is no room.
int log_pull(const LogPullOptions& options);

void add_log_pull(CLI::App& log, LogPullOptions& options, int& exit_code);

}  // namespace takt::command
