// SPDX-License-Identifier: Apache-2.0
#include "graph/command/machine_command.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "graph/cli/file_option.hpp"
#include "graph/cli/outcome.hpp"
#include "graph/language/words.hpp"
#include "graph/machine_file/apply.hpp"
#include "hal/settings/json.hpp"

namespace takt::command {
namespace {

using nlohmann::ordered_json;

/// Of a sound file; else its problems are on stderr.
std::optional<graph::MachineFile> load(const MachineOptions& options) {
  graph::LoadedMachine loaded = graph::load_machine(options.file);
  for (const graph::Problem& problem : loaded.problems) fmt::print(stderr, "{}\n", to_string(problem));
  return std::move(loaded.machine);
}

std::vector<std::string> texts(const std::vector<std::filesystem::path>& files) {
  std::vector<std::string> all;
  for (const auto& file : files) all.push_back(std::filesystem::absolute(file).string());
  return all;
}

ordered_json as_json(const graph::MachineFile& machine) {
  ordered_json files = ordered_json::array();
  for (const graph::SystemFile& file : graph::system_files(machine))
    files.push_back({{"path", file.path}, {"content", file.content}, {"link", file.link}, {"after", file.after}});
  return {{"machine", machine.name},
          {"kernel_arguments", graph::kernel_arguments(machine)},
          {"files", files},
          {"update_keys", texts(machine.update_keys)},
          {"ssh_keys", texts(machine.ssh_keys)},
          {"packages", machine.packages}};
}

int show(const MachineOptions& options) {
  const auto machine = load(options);
  if (!machine) return kBadInput;
  if (options.json) {
    fmt::print("{}\n", as_json(*machine).dump(2));
    return kOk;
  }
  fmt::print("{}: kernel line: {}\n", machine->name, graph::join_words(graph::kernel_arguments(*machine), " "));
  for (const graph::SystemFile& file : graph::system_files(*machine)) {
    if (file.link.empty()) fmt::print("\n{}\n{}", file.path, file.content);
    else fmt::print("\n{} -> {}\n", file.path, file.link);
  }
  return kOk;
}

void print_done(const graph::Applied& done) {
  const auto print = [](const char* what, const std::vector<std::string>& files) {
    for (const std::string& file : files) fmt::print("{:9}{}\n", what, file);
  };
  print("removed", done.removed), print("restored", done.restored), print("written", done.written);
  print("kept", done.kept);
  if (!done.kept.empty()) fmt::print(stderr, "takt: somebody changed what is kept since it was written; look at it\n");
}

int apply(const MachineOptions& options) {
  const auto machine = load(options);
  if (!machine) return kBadInput;
  std::vector<graph::SystemFile> files = graph::system_files(*machine);
  const auto words = graph::kernel_arguments(*machine);
  const bool grub = std::filesystem::exists(options.root / "etc/default/grub");
  if (grub && !words.empty()) files.push_back(graph::grub_file(*machine));
  const auto done = graph::apply_files(files, options.root);
  if (!done) return refuse(done.error(), kDeviceOrSystem);
  print_done(*done);
  if (options.root != "/") return kOk;
  std::vector<std::string> commands;
  for (const graph::SystemFile& file : files)
    if (!file.after.empty() && std::find(commands.begin(), commands.end(), file.after) == commands.end())
      commands.push_back(file.after);
  if (!commands.empty()) fmt::print("To take effect:\n");
  for (const std::string& command : commands) fmt::print("  sudo {}\n", command);
  if (words.empty()) return kOk;
  if (grub) fmt::print("The kernel's line takes effect with the next start.\n");
  else fmt::print("No GRUB of Debian here: add to the kernel's command line: {}\n", graph::join_words(words, " "));
  return kOk;
}

int undo(const MachineOptions& options) {
  const auto done = graph::undo_files(options.root);
  if (!done) return refuse(done.error(), kDeviceOrSystem);
  print_done(*done);
  if (done->removed.empty() && done->restored.empty() && done->kept.empty()) fmt::print("nothing was applied\n");
  else if (options.root == "/") fmt::print("All of it is gone with the next start.\n");
  return kOk;
}

}  // namespace

void add_machine(CLI::App& app, MachineOptions& o, int& exit_code) {
  CLI::App* machine = app.add_subcommand("machine", "what a machine file sets on a computer: CPUs, network, devices");
  machine->require_subcommand(1);
  const auto takes_file = [&](CLI::App* command) {
    reads_file(command->add_option("file", o.file, "the machine file")->required());
  };
  const auto takes_root = [&](CLI::App* command) {
    reads_folder(command->add_option("--root", o.root, "the system's files are below this folder"));
  };
  CLI::App* shown = machine->add_subcommand("show", "the kernel's command line and the files, without writing any");
  takes_file(shown);
  shown->add_flag("--json", o.json, "prints the result as JSON");
  shown->footer("Example: takt machine show vision_pc.yaml");
  shown->callback([&] { exit_code = show(o); });
  CLI::App* applied = machine->add_subcommand("apply", "writes them, and keeps what was there before");
  takes_file(applied), takes_root(applied);
  applied->footer("Example: sudo takt machine apply vision_pc.yaml");
  applied->callback([&] { exit_code = apply(o); });
  CLI::App* undone = machine->add_subcommand("undo", "puts back what was there before `apply`");
  takes_root(undone);
  undone->footer("Example: sudo takt machine undo");
  undone->callback([&] { exit_code = undo(o); });
}

}  // namespace takt::command
