// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <CLI/CLI.hpp>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "graph/plugins/plugins.hpp"

namespace takt::command {

struct ReplayOptions {
  std::filesystem::path log;
  std::filesystem::path graph;   ///< empty: that of the record
  std::filesystem::path params;  ///< parameter file; empty: that of the record
  std::filesystem::path output = "out";
  bool compare = false, recorded_pace = false, allow_damage = false;
  std::string isolate = "none";   ///< none | subsystem: a process for each, as in a run
  std::vector<std::string> live;  ///< nodes that run; empty: all. What the others made comes from the record
  std::vector<std::string> set;   ///< "node.param=value", after those of the record
  std::vector<std::filesystem::path> plugin_files;  ///< beside those that the graph names
  double from_s = 0;                                ///< since the epoch of the run
  // A what-if; see what_if_command.hpp.
  std::filesystem::path schedule, report;  ///< empty: that of the record; none is written
  std::optional<int> cores;
  std::optional<double> speed;
  bool json = false;
  bool asks_what_if() const { return !schedule.empty() || cores || speed; }
};

/// `takt replay LOG [GRAPH]`: runs every job of a record again, with the inputs and answers that it had. Exit 1 if
/// --compare finds a message that is not bit by bit the recorded one or compares none, if there is no job to be run, if
/// the record lacks what a job was given or is damaged or cut off (unless `allow_damage`); 2 if
/// the record, its graph or a file that the graph names cannot be used.
int replay(plugin::Plugins& plugins, const ReplayOptions& options);

void add_replay(CLI::App& app, plugin::Plugins& plugins, ReplayOptions& options, int& exit_code);

}  // namespace takt::command
