// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <CLI/CLI.hpp>
#include <string>

#include "graph/plugins/plugins.hpp"
#include "graph/rewind/recorded_run.hpp"

namespace takt::command {

struct ReplayOptions : rewind::ReplayOptions {
  bool inspect = false, web = false;
  std::string until_condition;  ///< of --break
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

struct BisectOptions : rewind::ReplayOptions {
  std::string condition;
  bool json = false;
};

/// `takt bisect RECORD CONDITION`: the first job from which on it does not hold, in few replays. Exit 0: found; 1: it
/// holds to the end; 2 as above.
int bisect(plugin::Plugins& plugins, const BisectOptions& options);

void add_bisect(CLI::App& app, plugin::Plugins& plugins, BisectOptions& options, int& exit_code);

void add_replay(CLI::App& app, plugin::Plugins& plugins, ReplayOptions& options, int& exit_code);

}  // namespace takt::command
