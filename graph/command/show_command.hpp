// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <optional>

#include "graph/run/run.hpp"

namespace takt::command {

struct ShowOptions {
  std::filesystem::path graph;
  graph::LoadOptions load;
  std::filesystem::path svg;  ///< empty: no SVG
  bool dot = false;
};

/// `takt show`: draws a graph; no device is opened. 0, or 2 for input that `takt check` would call invalid.
int show_graph(const Registry& registry, const ShowOptions& options);

struct RenderOptions {
  std::filesystem::path report, graph, html, output = "out";
  std::optional<std::filesystem::path> schedule;
};

/// `takt report`: a page from the report of an earlier run. 0, or 2 if report, graph or schedule do not fit.
int render_report(const Registry& registry, const RenderOptions& options);

}  // namespace takt::command
