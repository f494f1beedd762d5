// SPDX-License-Identifier: Apache-2.0
#include "graph/command/up_command.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <csignal>
#include <mutex>
#include <system_error>

#include "graph/cli/file_option.hpp"
#include "graph/cli/graph_file.hpp"
#include "graph/cli/outcome.hpp"
#include "graph/cli/set_option.hpp"
#include "graph/command/graph_commands.hpp"
#include "graph/command/stop_asked.hpp"
#include "graph/language/words.hpp"

namespace takt::command {
namespace {

using Json = nlohmann::ordered_json;

/// MACHINE=HOST, each once; the error says which machines there are.
tl::expected<std::map<std::string, std::string>, std::string> hosts_of(const graph::GraphSpec& graph,
                                                                       const std::vector<std::string>& texts) {
  std::vector<std::string> machines;
  for (const graph::MachineSpec& machine : graph.machines) machines.push_back(machine.name);
  std::map<std::string, std::string> hosts;
  for (const std::string& text : texts) {
    const size_t equals = text.find('=');
    const std::string machine = text.substr(0, equals);
    if (equals == std::string::npos || equals + 1 == text.size())
      return tl::unexpected(fmt::format("--host {}: write MACHINE=HOST", text));
    if (std::find(machines.begin(), machines.end(), machine) == machines.end())
      return tl::unexpected(fmt::format("--host {}: {} has no machine {}; machines: {}", text, graph.name,
                                        graph::ticked(machine), fmt::join(machines, ", ")));
    if (!hosts.emplace(machine, text.substr(equals + 1)).second)
      return tl::unexpected(fmt::format("--host {}: machine {} has one already", text, graph::ticked(machine)));
  }
  return hosts;
}

void tell_line(std::string_view machine, std::string_view line) {
  static std::mutex one_line;
  const std::lock_guard lock(one_line);
  fmt::print("[{}] {}\n", machine, line);
  std::fflush(stdout);
}

std::string what_became_of(const up::Part& part) {
  std::string text = fmt::format("{} on {}: ", part.machine, part.host);
  if (part.code != up::kLost) text += fmt::format("exit {}", part.code);
  if (!part.trouble.empty()) text += fmt::format("{}{}", part.code != up::kLost ? ", " : "", part.trouble);
  if (part.report.is_object()) text += fmt::format(", {:.1f} s", part.report.value("duration_s", 0.0));
  return text;
}

/// 0 and 1 as the runs have them, 2 as the one that refused its input; all else is the system's.
int together(const std::vector<up::Part>& parts) {
  int worst = kOk;
  for (const up::Part& part : parts) {
    if (part.told_to_end && part.code == 128 + SIGTERM) continue;  // before it ran
    const int code = part.code < 0 || part.code > kDeviceOrSystem ? kDeviceOrSystem : part.code;
    worst = std::max(worst, code <= kNotOk && !part.trouble.empty() ? static_cast<int>(kDeviceOrSystem) : code);
  }
  return worst;
}

int go(const Registry& registry, UpOptions& o) {
  const auto graph = load_graph(registry, o.graph, o.load);
  if (!graph) return kBadInput;
  if (graph->machines.empty())
    return refuse(fmt::format("{} has no `machines`: `takt run` runs it", graph->file), kBadInput);
  auto hosts = hosts_of(*graph, o.hosts);
  if (!hosts) return refuse(hosts.error(), kBadInput);
  o.how.hosts = std::move(*hosts);
  o.how.graph = o.graph.string();
  std::error_code error;
  std::filesystem::create_directories(o.how.out, error);
  if (error) return refuse(fmt::format("{}: {}", o.how.out.string(), error.message()), kDeviceOrSystem);
  const StopAsked stop;
  o.how.stopped = [] { return StopAsked::asked(); };
  o.how.told = tell_line;
  const std::vector<up::Part> parts = up::run(graph->machines, o.how);
  Json machines;
  for (const up::Part& part : parts) {
    fmt::print("{}\n", what_became_of(part));
    machines[part.machine] = {
        {"host", part.host}, {"exit", part.code}, {"trouble", part.trouble}, {"report", part.report}};
  }
  const Json together_told{{"graph", graph->name}, {"machines", machines}};
  const int written = write_output(o.how.out / "report.json", together_told.dump(1) + "\n", "--output");
  return written != kOk ? written : together(parts);
}

}  // namespace

void add_up(CLI::App& app, plugin::Plugins& plugins, UpOptions& o, int& exit_code) {
  o.how.out = "out";
  CLI::App* up = app.add_subcommand("up", "runs all machines of a graph at once, over ssh");
  reads_file(up->add_option("graph", o.graph, "graph file with `machines`; each machine has it under the same name"))
      ->required();
  up->add_option("--for", o.how.length_s, "how long, e.g. 20s (default 0s: until it is stopped)")
      ->transform(CLI::Validator(duration, "DURATION"));
  writes_folder(up->add_option("--output", o.how.out,
                               "folder for the reports of all, and report.json with all of them (default out)"));
  up->add_flag("--record", o.how.record, "each machine records its part; the records are fetched");
  up->add_option("--host", o.hosts, "MACHINE=HOST as ssh takes it, repeatable (default: the address in the graph)");
  up->add_option("--folder", o.how.folder, "the folder there that files are named from (default: that of ssh)");
  up->add_option("--program", o.how.program, "the program there (default takt; ./takt in a checkout)");
  up->add_option("--options", o.how.more, "more options of `takt run`, for all: \"--profile robot --keys keys\"");
  up->add_option("--ssh", o.how.ssh, "instead of ssh: a program that takes a host and a command, with its options")
      ->type_name("COMMAND");
  add_plugin_option(*up, o.load.plugin_files);
  up->footer(
      "Example: takt up graph/two_machines.yaml --host robot=me@robot --host vision=me@vision --folder takt --program "
      "./takt\n"
      "Ctrl-C ends all parts. A connection that breaks ends the part of its machine; the others go on.");
  up->callback([&] {
    exit_code = plugins.carry_out(graph_file(o.graph), o.load, [&](const Registry& known) { return go(known, o); });
  });
}

}  // namespace takt::command
