// SPDX-License-Identifier: Apache-2.0
#include "nodes/ground_map/ground_grid.hpp"

#include <algorithm>
#include <cmath>

namespace takt::ground_map {

GroundGrid::GroundGrid(int image_width, const GridParameters& parameters) : p_(parameters) {
  window_.cells = 2 * static_cast<int>(std::ceil(p_.window_m / 2 / p_.cell_m - 1e-9));
  window_.cell_m = p_.cell_m;
  window_.column = window_.row = -window_.cells / 2;
  const auto cells = static_cast<size_t>(window_.cells) * static_cast<size_t>(window_.cells);
  map_.assign(cells, kUnknown);
  observation_.assign(cells, kUnknown);
  tallies_.resize(cells);
  row_cells_.resize(static_cast<size_t>(image_width));
  column_.resize(static_cast<size_t>(image_width));
}

void GroundGrid::centre(const FloorPoint& robot) {
  const int n = window_.cells;
  const auto column = static_cast<int64_t>(std::floor(robot.x_m / p_.cell_m)) - n / 2;
  const auto row = static_cast<int64_t>(std::floor(robot.y_m / p_.cell_m)) - n / 2;
  const int64_t dx = column - window_.column, dy = row - window_.row;
  if (dx == 0 && dy == 0) return;
  window_.column = column;
  window_.row = row;
  // The new cell (c, r) is the old (c + dx, r + dy). In the order of the move no cell is read after it was written.
  const auto inside = [&](int64_t i) { return i >= 0 && i < n; };
  const bool backwards = dy < 0 || (dy == 0 && dx < 0);
  for (int k = 0; k < n * n; ++k) {
    const int index = backwards ? n * n - 1 - k : k;
    const int64_t from_column = index % n + dx, from_row = index / n + dy;
    map_[static_cast<size_t>(index)] =
        inside(from_column) && inside(from_row) ? map_[static_cast<size_t>(from_row * n + from_column)] : kUnknown;
  }
}

// Cells that the pixels of one row see. Coordinates in cells, so that a cell is the whole part of both.
void GroundGrid::project_row(const FloorProjection& to_cells, const FloorPoint& robot, int y, int width) {
  const auto& h = to_cells.h;
  const double x0 = h[1] * y + h[2], y0 = h[4] * y + h[5], w0 = h[7] * y + h[8];
  const double n = window_.cells, range = p_.range_max_m / p_.cell_m, range2 = range * range;
  for (int x = 0; x < width; ++x) {
    const double w = h[6] * x + w0, inverse = 1 / w;
    const double column = (h[0] * x + x0) * inverse, row = (h[3] * x + y0) * inverse;
    const double dx = column - robot.x_m, dy = row - robot.y_m;
    const bool seen = (w > FloorProjection::kHorizon) & (column >= 0) & (column < n) & (row >= 0) & (row < n) &
                      (dx * dx + dy * dy <= range2);
    row_cells_[static_cast<size_t>(x)] =
        seen ? static_cast<int32_t>(row) * window_.cells + static_cast<int32_t>(column) : kNone;
  }
}

/// The ground of a column leaves `cell`: it has run through it.
void GroundGrid::close(int32_t& cell) {
  if (cell >= 0 && p_.votes == Votes::columns) ++tallies_[static_cast<size_t>(cell)].free;
  cell = kNone;
}

bool GroundGrid::count_row(const uint8_t* mask, int width) {
  bool open = false;
  for (int x = 0; x < width; ++x) {
    int32_t& last = column_[static_cast<size_t>(x)];
    if (last == kEnded) continue;
    open = true;
    const int32_t cell = row_cells_[static_cast<size_t>(x)];
    if (!mask[x]) {
      if (cell != last) close(last);
      if (cell >= 0) ++tallies_[static_cast<size_t>(cell)].blocked;
      last = kEnded;
    } else {
      if (cell != last) close(last);
      if (cell >= 0 && p_.votes == Votes::pixels) ++tallies_[static_cast<size_t>(cell)].free;
      last = cell;
    }
  }
  return open;
}

void GroundGrid::observe(ImageView<const uint8_t> mask, const FloorProjection& projection, const FloorPoint& robot) {
  const FloorPoint origin = window_.origin();
  const FloorProjection to_cells = projection.scaled(origin, p_.cell_m);
  const FloorPoint robot_in_cells{(robot.x_m - origin.x_m) / p_.cell_m, (robot.y_m - origin.y_m) / p_.cell_m};
  std::fill(tallies_.begin(), tallies_.end(), Tally{});
  std::fill(column_.begin(), column_.end(), kNone);
  bool open = true;
  for (int y = mask.height; open && y-- > 0;) {
    project_row(to_cells, robot_in_cells, y, mask.width);
    open = count_row(mask.row(y), mask.width);
  }
  for (int32_t& cell : column_) close(cell);
  for (size_t i = 0; i < tallies_.size(); ++i) {
    const Tally& t = tallies_[i];
    if (t.free + t.blocked < std::max(1, p_.votes_min)) observation_[i] = kUnknown;
    else observation_[i] = t.free >= t.blocked ? kFree : kOccupied;
  }
}

void GroundGrid::accumulate() {
  for (size_t i = 0; i < map_.size(); ++i) {
    if (observation_[i] == kUnknown) continue;
    const int before = map_[i] == kUnknown ? kOccupied / 2 : map_[i];
    const int after = observation_[i] == kOccupied ? before + p_.up : before - p_.down;
    map_[i] = static_cast<int16_t>(std::clamp<int>(after, kFree, kOccupied));
  }
}

}  // namespace takt::ground_map
