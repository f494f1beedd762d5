// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <optional>
#include <vector>

#include "graph/language/graph.hpp"

namespace takt::command {

/// What a command line means by that graph: an empty one is the default graph.
std::filesystem::path graph_file(const std::filesystem::path& asked);
/// Loads only, no device is opened; nothing if the input is wrong, which is then written to stderr. `file` as for
/// graph_file().
std::optional<graph::GraphSpec> load_graph(const Registry& registry, const std::filesystem::path& file,
                                           const graph::LoadOptions& options);

/// Says on one line of stderr which values `takt set --keep` left for this graph, if any.
void tell_kept(const graph::GraphSpec& graph);
/// The overlay of that graph, if it exists: "takt: FILE is not used: WHY" on stderr.
void tell_ignored_overlay(const std::string& graph, const std::string& why);

/// Each on a line of stderr.
void tell(const std::vector<graph::Problem>& problems);
/// "takt: n problems, nothing was started"
void tell_problems(size_t count);

}  // namespace takt::command
