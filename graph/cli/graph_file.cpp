// SPDX-License-Identifier: Apache-2.0
#include "graph/cli/graph_file.hpp"

#include <cstdio>

#include "graph/cli/outcome.hpp"
#include "graph/compose/composition.hpp"

namespace takt::command {

std::filesystem::path graph_file(const std::filesystem::path& asked) {
  return asked.empty() ? shipped("graph/ace.yaml") : asked;
}

std::optional<graph::GraphSpec> load_graph(const std::filesystem::path& file, const graph::LoadOptions& options) {
  graph::Loaded loaded = graph::load(graph_file(file), options, graph::node_types());
  if (loaded.graph) return std::move(loaded.graph);
  tell(loaded.problems);
  tell_problems(loaded.problems.size());
  return std::nullopt;
}

void tell(const std::vector<graph::Problem>& problems) {
  for (const auto& problem : problems) std::fprintf(stderr, "%s\n", graph::to_string(problem).c_str());
}

void tell_problems(size_t count) {
  std::fprintf(stderr, "takt: %zu problem%s, nothing was started\n", count, count == 1 ? "" : "s");
}

}  // namespace takt::command
