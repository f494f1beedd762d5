// SPDX-License-Identifier: Apache-2.0
// Occupancy grids beside the one of the present view: of the whole map, and one laid over another.
#pragma once
#include <vector>

#include "nodes/mapping_3d/obstacle_grid.hpp"
#include "nodes/mapping_3d/tile_map.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/grid.hpp"
#include "rt/transform/planar_pose.hpp"

namespace takt::mapping_3d {

/// A grid to read: cell (column, row) covers origin + (column, row) * cell_m of its frame.
struct GridView {
  ImageView<const int16_t> cells;
  double cell_m = 0, origin_x_m = 0, origin_y_m = 0;
  Transform grid_in_map;
};
GridView view_of(const Grid& grid);

/// Adds another grid of the same map frame, wherever and however finely it lies and is turned: unknown yields to known,
/// otherwise the larger counts.
void fuse(const GridView& other, Grid& into);

/// A grid with memory of its own, for maps in files.
struct GridMap {
  int width = 0, height = 0;
  double cell_m = 0;
  PlanarPose corner;  ///< in the map: the corner of cell (0, 0), x along its columns
  std::vector<int16_t> cells;

  ImageView<const int16_t> view() const { return {cells.data(), width, height}; }
};
GridView view_of(const GridMap& map);

/// What a map of points says of a level floor: a cell with a point in z_floor .. robot_height is occupied, one with
/// points below alone free. With the axes of the map. Allocates.
GridMap grid_of(const TileMap& map, const ObstacleParameters& parameters);

}  // namespace takt::mapping_3d
