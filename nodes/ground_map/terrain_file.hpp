// SPDX-License-Identifier: Apache-2.0
// Maps of terrain in a plain file: those that were measured and those that were learnt from them have the same form.
#pragma once
#include <filesystem>
#include <iosfwd>
#include <stdexcept>
#include <string>

#include "nodes/ground_map/terrain.hpp"

namespace takt::ground_map {

/// What is wrong with a file, with its name and line.
struct TerrainError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Reads any number of maps of each kind, at least one, into the mean of each:
///
///     cells COLUMNS ROWS LEFT BEHIND METRES     once, first: the shape
///     map KIND                                  then ROWS lines of COLUMNS numbers, the farthest ahead first:
///     0 0 500 1000 -1 ...                       0 free .. 1000 occupied, -1 unknown
///
/// `#` begins a comment. `name` stands in errors.
TerrainLearning parse_terrain(std::istream& text, const std::string& name);
TerrainLearning read_terrain(const std::filesystem::path& file);

void write_terrain_shape(std::ostream& out, const TerrainShape& shape);
void write_terrain_map(std::ostream& out, const TerrainShape& shape, size_t kind, std::span<const int16_t> cells);

}  // namespace takt::ground_map
