// SPDX-License-Identifier: Apache-2.0
// Internal: the cells that the pixels of one image row see, vectorised.
#pragma once
#include <array>
#include <cstdint>

namespace takt::ground_map {

struct CellRow {
  std::array<double, 9> to_cells;  ///< FloorProjection::h, in units of a cell from the corner of the window
  double robot_column, robot_row;  ///< in the same units
  double range2;                   ///< squared range to the robot that is looked at, in cells
  int cells;                       ///< side of the window
};
constexpr int32_t kNoCell = -1;

/// out[x] = row * cells + column of the cell that pixel (x, y) sees, or kNoCell above the horizon, out of range and
/// outside the window, for x = 0 .. count - 1. In double, each operation rounded: every SIMD target gives the same.
void cells_of_row(const CellRow& row, int y, int count, int32_t* out);

}  // namespace takt::ground_map
