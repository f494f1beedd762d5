// SPDX-License-Identifier: Apache-2.0
// `takt run | check | show | report | explain | nodes | profile`: commands that read a graph, or what a run left.
#pragma once
#include <CLI/CLI.hpp>
#include <string>

#include "graph/command/explain_command.hpp"
#include "graph/command/profile_command.hpp"
#include "graph/command/show_command.hpp"
#include "graph/run/run.hpp"

namespace takt::command {

struct GraphOptions {
  RunOptions run, check;
  bool check_json = false;
  ShowOptions show;
  RenderOptions render;
  ExplainOptions explain;
  ProfileOptions profile;
  std::string type;  ///< of nodes
};

/// Adds the commands; each sets the exit code.
void add_graph_commands(CLI::App& app, GraphOptions& options, int& exit_code);

}  // namespace takt::command
