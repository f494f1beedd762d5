// SPDX-License-Identifier: Apache-2.0
// `takt top | echo | get | set | fault | mark | mode | stop`: commands that speak to a graph that is running already.
#pragma once
#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>
#include <string>

#include "graph/attach/endpoint.hpp"
#include "graph/language/graph.hpp"
#include "graph/plugins/plugins.hpp"

namespace takt::command {

struct AttachOptions {
  int run = 0;  ///< process id; 0: the only one that runs
  bool once = false, json = false;
  std::string machine;  ///< of a graph on several; empty: the one that has what is asked about
  std::string port, param, value, mode, words;
  std::string device, fault, on;      ///< of fault; `on`: "on" or "off"
  bool keep = false, forget = false;  ///< of set
  std::filesystem::path graph;        ///< of set --keep and --forget, where nothing runs; empty: the default graph
  graph::LoadOptions load;
  std::filesystem::path png, ply;  ///< of echo: at most one
  int64_t count = 1;
};

/// To the run with that process id, or (0) to the only one; else nothing, and why is said.
std::optional<attach::Connection> attached(int run);

/// Asks once; an answer that is an error is said, and its exit code returned.
int ask(attach::Connection& connection, const nlohmann::ordered_json& question, nlohmann::ordered_json& answer);

/// The exit code of `command`, also where the answer of the run is of another kind than it expects.
int understood(const std::function<int()>& command);

/// Adds the commands; each sets the exit code: 0 done, 2 refused or unknown, 3 nothing to attach to.
void add_attach_commands(CLI::App& app, plugin::Plugins& plugins, AttachOptions& options, int& exit_code);

}  // namespace takt::command
