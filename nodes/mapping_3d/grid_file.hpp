// SPDX-License-Identifier: Apache-2.0
// Grids in files as ROS's map_server has them: a picture and a YAML file that says what it means. For tools and the
// ends of runs, never in a job.
#pragma once
#include <filesystem>
#include <string>
#include <tl/expected.hpp>

#include "nodes/mapping_3d/map_grid.hpp"

namespace takt::mapping_3d {

/// Writes NAME.yaml and NAME.png beside it: white (254) free, black (0) occupied, 205 unknown, the top row the last one
/// of the grid; a cell is occupied above 0.65 and free below 0.196 of 1000, else it counts as unknown. Error: which
/// file cannot be written.
tl::expected<void, std::string> write_grid(const std::filesystem::path& yaml, const GridMap& map);

/// Reads such a file, also with `negate`, other thresholds and modes trinary and scale; the picture may be any that
/// OpenCV reads. Error: "FILE: ..." with the key at fault and what it may be.
tl::expected<GridMap, std::string> read_grid(const std::filesystem::path& yaml);

}  // namespace takt::mapping_3d
