// SPDX-License-Identifier: Apache-2.0
#include "nodes/ground_map/ground_grid.hpp"

#include <algorithm>
#include <cmath>

#include "nodes/ground_map/cell_kernel.hpp"

namespace takt::ground_map {
namespace {

/// Whether no pixel of row y, nor of any row above it, sees the floor: the fall of a ray is linear in x and y.
bool above_horizon(const FloorProjection& p, int y, int width) {
  const double fall_left = p.h[7] * y + p.h[8], fall_right = fall_left + p.h[6] * (width - 1);
  return p.h[7] >= 0 && std::max(fall_left, fall_right) <= FloorProjection::kHorizon;
}

}  // namespace

GroundGrid::GroundGrid(int image_width, const GridParameters& parameters) : p_(parameters) {
  window_.cells = 2 * static_cast<int>(std::ceil(p_.window_m / 2 / p_.cell_m - 1e-9));
  window_.cell_m = p_.cell_m;
  window_.column = window_.row = -window_.cells / 2;
  const auto cells = static_cast<size_t>(window_.cells) * static_cast<size_t>(window_.cells);
  map_.assign(cells, kUnknown);
  observation_.assign(cells, kUnknown);
  change_.resize(cells);
  tallies_.resize(cells);
  row_cells_.resize(static_cast<size_t>(image_width));
  column_.resize(static_cast<size_t>(image_width));
}

bool GroundGrid::resume(std::span<const int16_t> cells, const FloorPoint& origin) {
  if (cells.size() != map_.size()) return false;
  window_.column = std::llround(origin.x_m / p_.cell_m);
  window_.row = std::llround(origin.y_m / p_.cell_m);
  std::copy(cells.begin(), cells.end(), map_.begin());
  return true;
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

/// The ground of a column leaves `cell`: it has run through it.
void GroundGrid::close(int32_t& cell) {
  if (cell >= 0 && p_.votes == Votes::columns) ++tallies_[static_cast<size_t>(cell)].free;
  cell = kNoCell;
}

// Most pixels are ground in the same cell as the one below: nothing to do for a whole block of them.
bool GroundGrid::idle(const uint8_t* mask, int first) const {
  int busy = 0;
  for (int x = first; x < first + kBlock; ++x) {
    const int32_t last = column_[static_cast<size_t>(x)], cell = row_cells_[static_cast<size_t>(x)];
    busy |= static_cast<int>(last != kEnded) & (static_cast<int>(mask[x] == 0) | static_cast<int>(cell != last));
  }
  return busy == 0;
}

void GroundGrid::count_row(const uint8_t* mask, int width, int y, const Confidence& confidence) {
  for (int x = 0; x < width;) {
    if (p_.votes == Votes::columns && x + kBlock <= width && idle(mask, x)) {
      x += kBlock;
      continue;
    }
    for (const int end = std::min(x + kBlock, width); x < end; ++x) count(mask[x] != 0, x, y, confidence);
  }
}

void GroundGrid::count(bool ground, int x, int y, const Confidence& confidence) {
  int32_t& last = column_[static_cast<size_t>(x)];
  if (last == kEnded) return;
  const int32_t cell = row_cells_[static_cast<size_t>(x)];
  if (cell != last) close(last);
  last = ground ? cell : kEnded;
  open_ -= !ground;
  if (cell == kNoCell) return;
  Tally& tally = tallies_[static_cast<size_t>(cell)];
  tally.free += ground && p_.votes == Votes::pixels;
  if (ground) return;
  ++tally.blocked;
  tally.confidence += confidence.at(x, std::max(0, y - p_.beyond_px));
}

void GroundGrid::observe(ImageView<const uint8_t> mask, const FloorProjection& projection, const FloorPoint& robot,
                         const Confidence& confidence) {
  const FloorPoint origin = window_.origin();
  const double range = p_.range_max_m / p_.cell_m;
  const CellRow row{projection.scaled(origin, p_.cell_m).h, (robot.x_m - origin.x_m) / p_.cell_m,
                    (robot.y_m - origin.y_m) / p_.cell_m, range * range, window_.cells};
  std::fill(tallies_.begin(), tallies_.end(), Tally{});
  std::fill(column_.begin(), column_.end(), kNoCell);
  open_ = mask.width;
  for (int y = mask.height; open_ > 0 && y-- > 0 && !above_horizon(projection, y, mask.width);) {
    cells_of_row(row, y, mask.width, row_cells_.data());
    count_row(mask.row(y), mask.width, y, confidence);
  }
  for (int32_t& cell : column_) close(cell);
  for (size_t i = 0; i < tallies_.size(); ++i) {
    const Tally& t = tallies_[i];
    if (t.free + t.blocked < std::max(1, p_.votes_min)) observation_[i] = kUnknown;
    else observation_[i] = t.free >= t.blocked ? kFree : kOccupied;
    change_[i] =
        static_cast<int16_t>(observation_[i] == kOccupied ? p_.up * t.confidence / (kSure * t.blocked) : -p_.down);
  }
}

void GroundGrid::see_nothing() { std::fill(observation_.begin(), observation_.end(), kUnknown); }

void GroundGrid::accumulate() {
  for (size_t i = 0; i < map_.size(); ++i) {
    if (observation_[i] == kUnknown) continue;
    const int before = map_[i] == kUnknown ? kOccupied / 2 : map_[i];
    map_[i] = static_cast<int16_t>(std::clamp<int>(before + change_[i], kFree, kOccupied));
  }
}

}  // namespace takt::ground_map
