// SPDX-License-Identifier: Apache-2.0
#include "graph/command/keys_command.hpp"

#include <fmt/format.h>

#include "graph/cli/file_option.hpp"
#include "graph/cli/graph_file.hpp"
#include "graph/cli/outcome.hpp"
#include "graph/command/graph_commands.hpp"
#include "graph/keys/make_keys.hpp"

namespace takt::command {
namespace {

int make(const Registry& registry, const KeysOptions& options) {
  const auto graph = load_graph(registry, options.graph, options.load);
  if (!graph) return kBadInput;
  const auto done = keys::make_keys(*graph, options.out, options.days, std::time(nullptr));
  if (!done) return refuse(done.error().what, done.error().system ? kDeviceOrSystem : kBadInput);
  for (const std::string& line : *done) fmt::print("{}\n", line);
  return kOk;
}

}  // namespace

void add_keys(CLI::App& app, plugin::Plugins& plugins, KeysOptions& o, int& exit_code) {
  CLI::App* keys = app.add_subcommand("keys", "makes keys for the machines of a graph: who has none is not heard");
  reads_file(keys->add_option("graph", o.graph, "graph file with `machines` (default graph/ace.yaml)"));
  writes_folder(keys->add_option("--out", o.out, "folder for the authority and a folder per machine (default keys)"));
  keys->add_option("--days", o.days, "how long they are good for (default 1825: five years)")
      ->check(CLI::Range(1, 36500));
  add_plugin_option(*keys, o.load.plugin_files);
  keys->footer(
      "Example: takt keys graph/two_machines.yaml --out ~/robot_keys\n"
      "Then: scp -r ~/robot_keys/robot robot:keys, and there `takt run ... --machine robot --keys keys`.\n"
      "What is there already stays: a machine that is added gets keys that the others trust.");
  keys->callback([&] {
    exit_code = plugins.carry_out(graph_file(o.graph), o.load, [&](const Registry& known) { return make(known, o); });
  });
}

}  // namespace takt::command
