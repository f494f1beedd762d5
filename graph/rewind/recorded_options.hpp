// SPDX-License-Identifier: Apache-2.0
// How a record was made, as the options of a run: what commands that read records begin with.
#pragma once
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "graph/language/graph.hpp"
#include "graph/log/recorded_plan.hpp"
#include "graph/run/run.hpp"
#include "rt/record/log_file.hpp"

namespace takt::rewind {

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
  std::optional<double> until_s = {};               ///< likewise
  std::vector<std::string> conditions = {};         ///< in the language of `expect`: graph().asked
};

/// Ends the command with a reason: bad input.
struct Refused {
  std::string why;
};

/// An attachment of a record that is a JSON object. Throws Refused.
log::Json attached_json(const record::LogFile& file, const char* name);

/// Graph, schedule, parameters, profile, mode, policy and seed of the record, with what `options` say instead. Throws
/// Refused where a file is not there.
command::RunOptions recorded_options(const record::LogFile& file, const ReplayOptions& options);

/// Nodes of that graph say what they remember if they did so in the run.
void remember_as_recorded(graph::GraphSpec& graph, const record::LogFile& file);

/// The exit code of `command`, also where it throws: Refused, or what a record with an unreadable plan leads to.
int judged(const ReplayOptions& options, const std::function<int()>& command);

}  // namespace takt::rewind
