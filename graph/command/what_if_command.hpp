// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "graph/command/replay_command.hpp"

namespace takt::command {

/// `takt replay LOG --schedule FILE --cores N --speed F`: predicts from the times in a record what another schedule,
/// other cores or another computer would have kept, and prints it next to what the record says. Exit 0: every deadline
/// of high criticality, or what the graph expects; 1: not, or the record is damaged (unless `allow_damage`); 2: the
/// record or an option cannot be used, or the schedule is none of the record's graph.
int what_if(plugin::Plugins& plugins, const ReplayOptions& options);

/// --schedule, --cores and --speed; any of them asks for a what-if.
void add_what_if_options(CLI::App& replay, ReplayOptions& options);

}  // namespace takt::command
