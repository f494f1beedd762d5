// SPDX-License-Identifier: Apache-2.0
// `takt keys GRAPH --out FOLDER`: keys for the machines of a graph, without which anybody in their network takes part.
#pragma once
#include <CLI/CLI.hpp>
#include <filesystem>

#include "graph/language/graph.hpp"
#include "graph/plugins/plugins.hpp"

namespace takt::command {

struct KeysOptions {
  std::filesystem::path graph, out = "keys";
  graph::LoadOptions load;
  int days = 5 * 365;
};

/// Adds the command. Exit 0: done; 2: the graph is wrong, or other keys are there; 3: openssl or the disk fails.
void add_keys(CLI::App& app, plugin::Plugins& plugins, KeysOptions& options, int& exit_code);

}  // namespace takt::command
