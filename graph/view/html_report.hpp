// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>

#include "graph/language/graph.hpp"
#include "hal/settings/json.hpp"

namespace takt::view {

/// One self-contained page (UTF-8, no script, nothing fetched) from the report of a run: what was kept and what was
/// not, the graph, figures of nodes, edges and chains, lateness histograms, a timeline of jobs, memory, CPU, and the
/// pictures
/// (*.png) that lie in the folder `output`. What the report does not hold is shown as "not recorded"; a report of
/// another shape never throws.
std::string html_report(const Registry& registry, const nlohmann::ordered_json& report, const graph::GraphSpec& graph,
                        const std::filesystem::path& output);

}  // namespace takt::view
