// SPDX-License-Identifier: Apache-2.0
// What `takt nodes [TYPE]` prints.
#pragma once
#include <optional>
#include <string>

#include "rt/node.hpp"

namespace takt::graph {

/// All node types, one a line: name, layer, what it does.
std::string nodes_text(const NodeTypes& types);

/// Ports with their message types and parameters with default, unit, range and meaning.
std::string node_text(const NodeType& type);
/// The same by name; unknown: nothing, and `error` says which there are.
std::optional<std::string> node_text(const NodeTypes& types, std::string_view name, std::string& error);

}  // namespace takt::graph
