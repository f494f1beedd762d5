// SPDX-License-Identifier: Apache-2.0
#include "graph/cli/graph_file.hpp"

#include <fmt/format.h>

#include <cstdio>

#include "graph/cli/outcome.hpp"
#include "graph/language/overlay.hpp"
#include "graph/language/registry.hpp"

namespace takt::command {

std::filesystem::path graph_file(const std::filesystem::path& asked) {
  return asked.empty() ? shipped("graph/ace.yaml") : asked;
}

std::optional<graph::GraphSpec> load_graph(const Registry& registry, const std::filesystem::path& file,
                                           const graph::LoadOptions& options) {
  graph::Loaded loaded = graph::load(graph_file(file), options, registry);
  if (loaded.graph) return std::move(loaded.graph);
  tell(loaded.problems);
  tell_problems(loaded.problems.size());
  return std::nullopt;
}

void tell_kept(const graph::GraphSpec& graph) {
  if (graph.kept.values.empty()) return;
  std::string values;
  for (const auto& value : graph.kept.values)
    values += fmt::format("{}{} {}{}", values.empty() ? "" : ", ", value.name, value.text,
                          value.overridden ? " (--set wins)" : "");
  std::fprintf(stderr, "takt: kept values of %s: %s\n", graph.kept.file.c_str(), values.c_str());
}

void tell_ignored_overlay(const std::string& graph, const std::string& why) {
  const auto file = graph::overlay_file(graph::state_folder(), graph);
  std::error_code ignored;
  if (std::filesystem::exists(file, ignored))
    std::fprintf(stderr, "takt: %s is not used: %s\n", file.c_str(), why.c_str());
}

void tell(const std::vector<graph::Problem>& problems) {
  for (const auto& problem : problems) std::fprintf(stderr, "%s\n", graph::to_string(problem).c_str());
}

void tell_problems(size_t count) {
  std::fprintf(stderr, "takt: %zu problem%s, nothing was started\n", count, count == 1 ? "" : "s");
}

}  // namespace takt::command
