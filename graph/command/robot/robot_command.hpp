// SPDX-License-Identifier: Apache-2.0
// `takt robot ...`: telling and asking the robot client of a running graph, over the socket of `takt top`.
#pragma once
#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>
#include <vector>

namespace takt::command {

struct RobotOptions {
  int run = 0;       ///< process id; 0: the only one that has a robot client
  std::string node;  ///< of type robot_client; empty: the only one
  std::vector<std::string> words;
  std::string object;
  std::filesystem::path dot;
};

/// Adds the command; exit code 0 done, 2 refused or unknown, 3 nothing to attach to.
void add_robot(CLI::App& app, RobotOptions& options, int& exit_code);

}  // namespace takt::command
