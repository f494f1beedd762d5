// SPDX-License-Identifier: Apache-2.0
#include "graph/command/prepare.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>

namespace takt::command {
namespace {

void tell(const std::vector<graph::Problem>& problems) {
  for (const auto& problem : problems) std::fprintf(stderr, "%s\n", graph::to_string(problem).c_str());
  std::fprintf(stderr, "takt: %zu problem%s, nothing was started\n", problems.size(), problems.size() == 1 ? "" : "s");
}

int refuse(Prepared& prepared, std::vector<graph::Problem> problems, Exit code) {
  tell(problems);
  prepared.problems = std::move(problems);
  return code;
}

graph::DeviceFactory device_factory(Prepared& prepared, uint64_t seed) {
  return [&prepared, seed](const graph::DeviceSpec& spec) -> tl::expected<std::unique_ptr<Node>, graph::ComposeError> {
    const hal::DeviceConfig config{spec.id, spec.kind, spec.driver, spec.settings, prepared.graph->directory, seed};
    auto node = hal::make_device(config, prepared.devices, *prepared.clock);
    if (node) return std::move(*node);
    graph::ComposeError error;
    error.problems.push_back({spec.position, node.error().text()});
    error.device_failed = !node.error().bad_input;
    return tl::make_unexpected(std::move(error));
  };
}

/// The graph named, or the one the command ships with: beside the launcher, or in share/takt beside an installed bin/.
std::filesystem::path graph_file(const std::filesystem::path& named) {
  if (!named.empty()) return named;
  if (const char* home = std::getenv("TAKT_HOME")) return std::filesystem::path(home) / "graph/ace.yaml";
  std::error_code error;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
  const auto installed = program.parent_path().parent_path() / "share/takt/graph/ace.yaml";
  return std::filesystem::exists(installed, error) ? installed : std::filesystem::path("graph/ace.yaml");
}

}  // namespace

int refuse(const std::string& text, Exit code) {
  std::fprintf(stderr, "takt: error: %s\n", text.c_str());
  return code;
}

std::optional<graph::GraphSpec> load_graph(const std::filesystem::path& file, const graph::LoadOptions& options) {
  graph::Loaded loaded = graph::load(graph_file(file), options, graph::node_types());
  if (!loaded.graph) tell(loaded.problems);
  return std::move(loaded.graph);
}

int prepare(const RunOptions& options, Prepared& prepared) {
  const NodeTypes types = graph::node_types();
  graph::Loaded loaded = graph::load(graph_file(options.graph), options.load, types);
  if (!loaded.graph) return refuse(prepared, std::move(loaded.problems), kBadInput);
  prepared.graph = std::move(loaded.graph);
  if (options.clock == "virtual") prepared.clock = std::make_unique<VirtualClock>(1'000'000'000);
  else prepared.clock = std::make_unique<MonotonicClock>();
  auto composition = graph::compose(*prepared.graph, types, device_factory(prepared, options.seed), *prepared.clock,
                                    {options.output, options.seed});
  if (!composition)
    return refuse(prepared, std::move(composition.error().problems),
                  composition.error().device_failed ? kDeviceOrSystem : kBadInput);
  prepared.composition = std::move(*composition);
  return kOk;
}

}  // namespace takt::command
