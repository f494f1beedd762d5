// SPDX-License-Identifier: Apache-2.0
// How a record was made, as the options of a run: what commands that read records begin with.
#pragma once
#include <functional>
#include <string>

#include "graph/command/replay_command.hpp"
#include "graph/log/recorded_plan.hpp"
#include "graph/run/run.hpp"
#include "rt/record/log_file.hpp"

namespace takt::command {

/// Ends the command with a reason: bad input.
struct Refused {
  std::string why;
};

/// An attachment of a record that is a JSON object. Throws Refused.
log::Json attached_json(const record::LogFile& file, const char* name);

/// Graph, schedule, parameters, profile, mode, policy and seed of the record, with what `options` say instead. Throws
/// Refused where a file is not there.
RunOptions recorded_options(const record::LogFile& file, const ReplayOptions& options);

/// The exit code of `command`, also where it throws: Refused, or what a record with an unreadable plan leads to.
int judged(const ReplayOptions& options, const std::function<int()>& command);

}  // namespace takt::command
