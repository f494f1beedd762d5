// SPDX-License-Identifier: Apache-2.0
#include "graph/command/prepare.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>

#include "graph/command/run_record.hpp"

namespace takt::command {
namespace {

void tell(const std::vector<graph::Problem>& problems) {
  for (const auto& problem : problems) std::fprintf(stderr, "%s\n", graph::to_string(problem).c_str());
}

int refuse(Prepared& prepared, std::vector<graph::Problem> problems, Exit code) {
  tell(problems);
  prepared.problems = std::move(problems);
  return code;
}

graph::DeviceFactory device_factory(Prepared& prepared, uint64_t seed) {
  return [&prepared, seed](const graph::DeviceSpec& spec) -> tl::expected<std::unique_ptr<Node>, graph::ComposeError> {
    const hal::DeviceConfig config{spec.id, spec.kind,       spec.driver, spec.settings, prepared.graph->directory,
                                   seed,    prepared.plugged};
    auto node = hal::make_device(config, prepared.devices, *prepared.clock);
    if (node) return std::move(*node);
    graph::ComposeError error;
    error.problems.push_back({spec.position, node.error().text()});
    error.device_failed = !node.error().bad_input;
    return tl::make_unexpected(std::move(error));
  };
}

}  // namespace

std::filesystem::path shipped(const std::filesystem::path& relative) {
  if (const char* home = std::getenv("TAKT_HOME")) return std::filesystem::path(home) / relative;
  std::error_code error;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
  const auto installed = program.parent_path().parent_path() / "share/takt" / relative;
  return std::filesystem::exists(installed, error) ? installed : relative;
}

int refuse(const std::string& text, Exit code) {
  std::fprintf(stderr, "takt: error: %s\n", text.c_str());
  return code;
}

void tell_problems(size_t count) {
  std::fprintf(stderr, "takt: %zu problem%s, nothing was started\n", count, count == 1 ? "" : "s");
}

std::optional<graph::GraphSpec> load_graph(const std::filesystem::path& file, const graph::LoadOptions& options) {
  graph::Loaded loaded = graph::load(file.empty() ? shipped("graph/ace.yaml") : file, options, graph::node_types());
  if (loaded.graph) return std::move(loaded.graph);
  tell(loaded.problems);
  tell_problems(loaded.problems.size());
  return std::nullopt;
}

int load(const RunOptions& options, Prepared& prepared) {
  const auto file = options.graph.empty() ? shipped("graph/ace.yaml") : options.graph;
  graph::Loaded loaded = graph::load(file, options.load, graph::node_types());
  if (!loaded.graph) return refuse(prepared, std::move(loaded.problems), kBadInput);
  prepared.graph = std::move(loaded.graph);
  if (options.clock == "virtual") prepared.clock = std::make_unique<VirtualClock>(1'000'000'000);
  else prepared.clock = std::make_unique<MonotonicClock>();
  return kOk;
}

int compose(const RunOptions& options, const graph::ComposeOptions& how, Prepared& prepared) {
  auto composition = graph::compose(*prepared.graph, graph::node_types(), device_factory(prepared, options.seed),
                                    *prepared.clock, how);
  if (!composition)
    return refuse(prepared, std::move(composition.error().problems),
                  composition.error().device_failed ? kDeviceOrSystem : kBadInput);
  prepared.composition = std::move(*composition);
  return kOk;
}

int prepare_check(const RunOptions& options, Prepared& prepared) {
  prepared.plugged = false;
  int code = load(options, prepared);
  if (code == kOk) {
    graph::ComposeOptions how;
    how.output = options.output;
    how.seed = options.seed;
    how.observers = observers(options, *prepared.graph);
    code = compose(options, how, prepared);
  }
  if (code != kOk) tell_problems(prepared.problems.size());
  return code;
}

}  // namespace takt::command
