// SPDX-License-Identifier: Apache-2.0
#include "nodes/mapping_3d/map_grid.hpp"

#include <algorithm>
#include <cmath>

#include "rt/transform/pose_math.hpp"

namespace takt::mapping_3d {
namespace {

constexpr double kFarthest_m = 10'000;  // a stray point must not make a grid of any size

int cell_of(double offset_m, double cell_m) { return static_cast<int>(std::floor(offset_m / cell_m)); }

void raise(int16_t other, int16_t& cell) { cell = std::max(cell, other); }  // unknown is less than all

}  // namespace

GridView view_of(const Grid& grid) {
  return {grid.view(), grid.cell_m, grid.origin_x_m, grid.origin_y_m, grid.grid_in_map};
}

GridView view_of(const GridMap& map) {
  const double half = map.corner.theta_rad / 2;
  return {map.view(), map.cell_m, 0, 0, {map.corner.x_m, map.corner.y_m, 0, std::cos(half), 0, 0, std::sin(half)}};
}

void fuse(const GridView& other, Grid& into) {
  const UncertainPose other_in_map{other.grid_in_map, {}}, into_in_map{into.grid_in_map, {}};
  const Affine to_into = to_affine(compose(inverse(into_in_map), other_in_map).transform);
  const Affine to_other = to_affine(compose(inverse(other_in_map), into_in_map).transform);
  const ImageView<int16_t> cells = into.view();
  // From each side once: the finer grid has several cells in one of the other.
  for (int row = 0; row < other.cells.height; ++row)
    for (int column = 0; column < other.cells.width; ++column) {
      const Position p = transformed(to_into, other.origin_x_m + (column + 0.5) * other.cell_m,
                                     other.origin_y_m + (row + 0.5) * other.cell_m, 0);
      const int c = cell_of(p.x_m - into.origin_x_m, into.cell_m), r = cell_of(p.y_m - into.origin_y_m, into.cell_m);
      if (cells.contains(c, r)) raise(other.cells.at(column, row), cells.at(c, r));
    }
  for (int row = 0; row < cells.height; ++row)
    for (int column = 0; column < cells.width; ++column) {
      const Position p = transformed(to_other, into.origin_x_m + (column + 0.5) * into.cell_m,
                                     into.origin_y_m + (row + 0.5) * into.cell_m, 0);
      const int c = cell_of(p.x_m - other.origin_x_m, other.cell_m),
                r = cell_of(p.y_m - other.origin_y_m, other.cell_m);
      if (other.cells.contains(c, r)) raise(other.cells.at(c, r), cells.at(column, row));
    }
}

GridMap grid_of(const TileMap& map, const ObstacleParameters& p) {
  double low_x = kFarthest_m, low_y = kFarthest_m, high_x = -kFarthest_m, high_y = -kFarthest_m;
  const auto near = [](const Position& at) { return std::max(std::abs(at.x_m), std::abs(at.y_m)) < kFarthest_m; };
  map.for_each([&](const Position& at, const MapPoint&) {
    if (!near(at)) return;
    low_x = std::min(low_x, at.x_m), high_x = std::max(high_x, at.x_m);
    low_y = std::min(low_y, at.y_m), high_y = std::max(high_y, at.y_m);
  });
  GridMap grid;
  grid.cell_m = p.voxel_m;
  if (low_x > high_x) return grid;
  grid.corner = {std::floor(low_x / p.voxel_m) * p.voxel_m, std::floor(low_y / p.voxel_m) * p.voxel_m, 0};
  grid.width = cell_of(high_x - grid.corner.x_m, p.voxel_m) + 1;
  grid.height = cell_of(high_y - grid.corner.y_m, p.voxel_m) + 1;
  grid.cells.assign(static_cast<size_t>(grid.width) * static_cast<size_t>(grid.height), kUnknown);
  const ImageView<int16_t> cells{grid.cells.data(), grid.width, grid.height};
  map.for_each([&](const Position& at, const MapPoint&) {
    if (!near(at) || at.z_m >= p.robot_height_m) return;
    raise(at.z_m < p.z_floor_m ? kFree : kOccupied,
          cells.at(cell_of(at.x_m - grid.corner.x_m, p.voxel_m), cell_of(at.y_m - grid.corner.y_m, p.voxel_m)));
  });
  return grid;
}

}  // namespace takt::mapping_3d
