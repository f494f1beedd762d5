// SPDX-License-Identifier: Apache-2.0
#include "graph/command/program.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <string>
#include <vector>

#include "graph/cli/outcome.hpp"
#include "graph/command/attach_commands.hpp"
#include "graph/command/doctor_command.hpp"
#include "graph/command/graph_commands.hpp"
#include "graph/command/log_commands.hpp"
#include "graph/command/other_programs.hpp"
#include "graph/command/replay_command.hpp"
#include "graph/run/commit.hpp"
#include "rt/capability.hpp"

namespace takt::command {
namespace {

/// "0.1.0 (commit c52565a2)"
std::string version_text() { return fmt::format("takt {} (commit {})", TAKT_VERSION, kCommit); }

std::vector<std::string> names(const CLI::App& app) {
  std::vector<std::string> all;
  for (const CLI::App* command : app.get_subcommands(nullptr)) all.push_back(command->get_name());
  return all;
}

}  // namespace

int run_program(int argc, char** argv, const MoreCommands& more) {
  hold_standard_streams();
  keep_rights(Rights::observe);
  CLI::App app{"Takt: a real-time dataflow runtime with a static task graph", "takt"};
  app.set_version_flag("--version", version_text, "prints version, commit and ABI");
  int exit_code = 0;
  GraphOptions graph;
  AttachOptions attach;
  DoctorOptions doctor;
  ReplayOptions replay;
  LogOptions log;
  add_graph_commands(app, graph, exit_code);
  add_attach_commands(app, attach, exit_code);
  add_doctor(app, doctor, exit_code);
  add_replay(app, replay, exit_code);
  add_log(app, log, exit_code);
  const auto options_of_more = more ? more(app, exit_code) : nullptr;
  auto own = names(app);
  if (argc > 1 && argv[1][0] != '-' && std::find(own.begin(), own.end(), argv[1]) == own.end())
    return become_other_program(argv, std::move(own));
  for (const DeskCommand& command : desk_commands())
    app.add_subcommand(command.name, command.what);  // for the list only
  app.require_subcommand(0, 1);
  try {
    app.parse(argc, argv);
    if (app.get_subcommands().empty()) fmt::print("{}", app.help());
  } catch (const CLI::ParseError& error) {
    exit_code = app.exit(error) == 0 ? 0 : kBadInput;
  }
  return with_output(exit_code);
}

}  // namespace takt::command
