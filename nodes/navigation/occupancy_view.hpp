// SPDX-License-Identifier: Apache-2.0
// An occupancy grid with its place in the map: what the path planner and the semantic map look at.
#pragma once
#include <cmath>

#include "rt/msg/image_view.hpp"

namespace takt::navigation {

struct Cell {
  int column = 0, row = 0;
  bool operator==(const Cell&) const = default;
};

/// Cells 0 free .. 1000 occupied, -1 unknown (E-21), those of row 0 with the least y; axes of
/// the map frame. Cell (column, row) covers origin + (column, row) * cell_m.
struct OccupancyView {
  ImageView<const int16_t> cells;
  double cell_m = 0.3;
  double origin_x_m = 0, origin_y_m = 0;

  Cell cell_of(double x_m, double y_m) const {
    return {static_cast<int>(std::floor((x_m - origin_x_m) / cell_m)),
            static_cast<int>(std::floor((y_m - origin_y_m) / cell_m))};
  }
  bool contains(const Cell& cell) const { return cells.contains(cell.column, cell.row); }
  double middle_x_m(const Cell& cell) const { return origin_x_m + (cell.column + 0.5) * cell_m; }
  double middle_y_m(const Cell& cell) const { return origin_y_m + (cell.row + 0.5) * cell_m; }
};

/// More than this is occupied.
constexpr int16_t kHalfOccupied = 500;
constexpr int16_t kUnknownCell = -1;

}  // namespace takt::navigation
