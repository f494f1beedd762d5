// SPDX-License-Identifier: Apache-2.0
// The semantic network for other programs: Graphviz, and whatever reads GraphML. Not for jobs; these functions
// allocate.
#pragma once
#include <string>

#include "nodes/semantic/semantic_map.hpp"

namespace takt::semantic {

/// An undirected graph; nodes are shaped by kind, objects tell their known states, edges what connects (Tab. 5.1).
std::string to_dot(const SemanticMap& map);

/// GraphML 1.0 with keys name, kind, x and y (objects, m), states (objects, "level=full") and relation (edges).
std::string to_graphml(const SemanticMap& map);

}  // namespace takt::semantic
