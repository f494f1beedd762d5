// SPDX-License-Identifier: Apache-2.0
// Predefined networks as YAML: what there can be, and what is known of what there is. Read before start; allocates.
//
//   takt_network: 1
//   attributes:
//     level:  {kind: enumerated, words: [empty, full]}
//     mass:   {kind: scalar, range: [0kg, 20kg]}
//     colour: {kind: colour, identity: true}                  # objects that differ much in it are two
//     closed: {kind: boolean}
//   types:
//     cup:    {attributes: {level: 1, colour: 2}}             # with their weights in comparisons, 0 or more
//     bottle: {attributes: [level, closed]}                   # each 1
//   actions:
//     fill:
//       roles: {target: cup, source: bottle}                  # visited in this order
//       cost: 6s
//       requires: {target.level: empty, source.level: full, source.closed: false}
//       results: {target.level: full, source.level: empty}
//   objects:
//     cup_1: {type: cup, at: [1m, 2m], states: {level: empty}}
#pragma once
#include <filesystem>

#include "nodes/semantic/semantic_map.hpp"

namespace takt::semantic {

/// Adds what the file says to the map, which may hold something already; a type, attribute or action that it holds is
/// not named again. Every mistake of the file as "FILE:LINE:COLUMN: what; what is valid", and the map is then of no
/// use.
tl::expected<void, std::vector<std::string>> read_network(const std::filesystem::path& file, SemanticMap& map);

/// The same for text; `name` stands for the file in mistakes.
tl::expected<void, std::vector<std::string>> parse_network(const std::string& text, const std::string& name,
                                                           SemanticMap& map);

}  // namespace takt::semantic
