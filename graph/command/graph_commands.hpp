// SPDX-License-Identifier: Apache-2.0
// `takt run | check | show | report | explain | nodes | profile`: commands that read a graph, or what a run left.
#pragma once
#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>
#include <vector>

#include "graph/command/explain_command.hpp"
#include "graph/command/profile_command.hpp"
#include "graph/command/show_command.hpp"
#include "graph/plugins/plugins.hpp"
#include "graph/run/run.hpp"

namespace takt::command {

struct NodesOptions {
  std::string type;
  graph::LoadOptions load;  ///< of which only the plug-ins
};

struct GraphOptions {
  RunOptions run, check;
  bool check_json = false;
  ShowOptions show;
  RenderOptions render;
  ExplainOptions explain;
  ProfileOptions profile;
  NodesOptions nodes;
};

/// --plugin FILE.
void add_plugin_option(CLI::App& app, std::vector<std::filesystem::path>& files);

/// The graph, and what of it: profile, schedule, mode, parameters.
void add_load_options(CLI::App& app, std::filesystem::path& graph, graph::LoadOptions& load);

/// Adds the commands; each loads the plug-ins of its graph, and sets the exit code.
void add_graph_commands(CLI::App& app, plugin::Plugins& plugins, GraphOptions& options, int& exit_code);

}  // namespace takt::command
