// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/msg/grid.hpp>: core, stable.
#pragma once
#include <cstdint>
#include <span>
#include <string_view>

#include "rt/msg/array.hpp"
#include "rt/msg/field_list.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/image_view.hpp"
#include "rt/msg/viewer.hpp"

namespace takt {

/// Two-dimensional occupancy grid. Cell (column, row) covers origin + (column, row) * cell_m. Capacity: width, height.
struct Grid {
  static constexpr std::string_view type_name = "grid";
  static constexpr int16_t unknown = -1;
  int32_t width = 0, height = 0;
  double cell_m = 0;
  double origin_x_m = 0, origin_y_m = 0;
  Transform grid_in_map;
  Array<int16_t> cells;  ///< 0 free .. 1000 occupied, `unknown` = -1

  ImageView<int16_t> view() { return {cells.data(), width, height}; }
  ImageView<const int16_t> view() const { return {cells.data(), width, height}; }
  bool sound() const { return image_fits(width, height, 1, cells.capacity); }
  void show(Viewer& to) const { to.grid({view(), cell_m, origin_x_m, origin_y_m}); }
  TAKT_FIELDS(Grid, (width, "1"), (height, "1"), (cell_m, "m"), (origin_x_m, "m"), (origin_y_m, "m"), (grid_in_map),
              (cells, "1", capacity.pixels()))
};

}  // namespace takt
