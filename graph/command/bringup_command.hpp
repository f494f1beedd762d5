// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>
#include <vector>

#include "graph/plugins/plugins.hpp"
#include "graph/run/run.hpp"

namespace takt::command {

struct BringupOptions {
  RunOptions run;
  std::filesystem::path file;        ///< what is known; empty: that of the state folder
  std::vector<std::string> devices;  ///< only these; empty: what was not tried yet with these settings
  bool list = false, again = false, doubles = false;
  double patience_s = 60;
};

/// `takt bringup GRAPH`: tries device by device with a person beside the robot, then its stop on the ground, and keeps
/// the outcome. Exit 0: all that the graph has was tried and is well; 1: something is not; 2 and 3 as ever.
int bring_up(const Registry& registry, const BringupOptions& options);

/// Whether the graph may drive: kOk, or bad input, and what was not tried stands on stderr. `--brought-up`.
int may_drive(const Registry& registry, const RunOptions& options);

void add_bringup(CLI::App& app, plugin::Plugins& plugins, BringupOptions& options, int& exit_code);

}  // namespace takt::command
