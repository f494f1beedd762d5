// SPDX-License-Identifier: Apache-2.0
// `takt up GRAPH`: all machines of a graph run at once, from one place, over ssh.
#pragma once
#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>
#include <vector>

#include "graph/plugins/plugins.hpp"
#include "graph/up/up.hpp"

namespace takt::command {

struct UpOptions {
  std::filesystem::path graph;
  graph::LoadOptions load;         ///< of which only the plug-ins
  std::vector<std::string> hosts;  ///< MACHINE=HOST
  up::Options how;
};

/// Adds the command. Exit 0: all parts ended well; 1: one ran, but not well; 2: the graph, or what a machine was asked,
/// is wrong; 3: a machine could not be reached, or something there or here failed.
void add_up(CLI::App& app, plugin::Plugins& plugins, UpOptions& options, int& exit_code);

}  // namespace takt::command
