// SPDX-License-Identifier: Apache-2.0
// The pictures of a graph, each from the same diagram.
#pragma once
#include <string>

#include "graph/view/diagram.hpp"

namespace takt::view {

/// A complete SVG document (UTF-8, no script, nothing fetched), readable on light and on dark background. Each node and
/// device is a <g> with its id as data-id, each edge a <g> with data-from and data-to.
std::string graph_svg(const Diagram& diagram);

/// Graphviz text; devices and subsystems are clusters.
std::string graph_dot(const Diagram& diagram);

/// Plain text of at most 80 columns (a single longer word stays whole): what each node reads, by subsystem.
std::string graph_listing(const Diagram& diagram);

}  // namespace takt::view
