// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <string>
#include <vector>

#include "graph/cli/boundary.hpp"
#include "graph/cli/outcome.hpp"
#include "graph/command/attach_commands.hpp"
#include "graph/command/bringup_command.hpp"
#include "graph/command/doctor_command.hpp"
#include "graph/command/graph_commands.hpp"
#include "graph/command/keys_command.hpp"
#include "graph/command/log_commands.hpp"
#include "graph/command/machine_command.hpp"
#include "graph/command/new_command.hpp"
#include "graph/command/other_programs.hpp"
#include "graph/command/replay_command.hpp"
#include "graph/command/service_commands.hpp"
#include "graph/command/up_command.hpp"
#include "graph/main.hpp"
#include "graph/plugins/plugins.hpp"
#include "rt/abi.hpp"
#include "rt/capability.hpp"

namespace takt::command {
namespace {

/// Version, commit and ABI; where libtakt_core is of another build than this program, what differs.
std::string version_text() {
  const Version core = version();
  std::string text = fmt::format("takt {} (commit {})\nABI: {}", core.number, core.commit, kAbi);
  if (core.abi != kAbi) text += fmt::format("\nlibtakt_core: {}", abi_difference(core.abi, kAbi));
  return text;
}

std::vector<std::string> names(const CLI::App& app) {
  std::vector<std::string> all;
  for (const CLI::App* command : app.get_subcommands(nullptr)) all.push_back(command->get_name());
  return all;
}

/// Parses, and runs the command; the exit code.
int run(int argc, char** argv, const std::function<void(Registry&)>& fill, const MoreCommands& more) {
  Registry registry;
  try {
    fill(registry);
  } catch (const std::exception& error) {
    return refuse(fmt::format("this program registers nothing: {}", error.what()), kBadInput);
  }
  plugin::Plugins plugins(registry);
  CLI::App app{"Takt: a real-time dataflow runtime with a static task graph", "takt"};
  app.set_version_flag("--version", version_text, "prints version, commit and ABI");
  int exit_code = 0;
  GraphOptions graph;
  AttachOptions attach;
  DoctorOptions doctor;
  ReplayOptions replay;
  BisectOptions bisect;
  LogOptions log;
  NewOptions project;
  ServiceOptions service;
  MachineOptions machine;
  KeysOptions keys;
  UpOptions up;
  BringupOptions bringup;
  add_graph_commands(app, plugins, graph, exit_code);
  add_attach_commands(app, plugins, attach, exit_code);
  add_doctor(app, doctor, exit_code);
  add_replay(app, plugins, replay, exit_code);
  add_bisect(app, plugins, bisect, exit_code);
  add_log(app, registry, log, exit_code);
  add_new(app, project, exit_code);
  add_service_commands(app, service, exit_code);
  add_machine(app, machine, exit_code);
  add_keys(app, plugins, keys, exit_code);
  add_up(app, plugins, up, exit_code);
  add_bringup(app, plugins, bringup, exit_code);
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
  return exit_code;
}

}  // namespace
}  // namespace takt::command

namespace takt {

int main(int argc, char** argv, const std::function<void(Registry&)>& fill, const MoreCommands& more) {
  return command::at_boundary(argc, argv, [&] {
    keep_rights(Rights::observe);
    return command::run(argc, argv, fill, more);
  });
}

}  // namespace takt
