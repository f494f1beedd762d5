// SPDX-License-Identifier: Apache-2.0
#include "nodes/scan_matching/occupancy_map.hpp"

#include <algorithm>
#include <cmath>

namespace takt::scan_matching {
namespace {

constexpr uint8_t kPassed = 1, kEnded = 2;

/// round(a / b), halves up; b > 0.
int64_t rounded(int64_t a, int64_t b) {
  const int64_t n = 2 * a + b, d = 2 * b;
  return n >= 0 ? n / d : -((d - 1 - n) / d);
}

}  // namespace

OccupancyMap::OccupancyMap(const OccupancyParameters& parameters)
    : p_(parameters),
      side_(2 * static_cast<int>(std::ceil(p_.window_m / 2 / p_.cell_m - 1e-9))),
      column_(-side_ / 2),
      row_(-side_ / 2) {
  const auto count = static_cast<size_t>(side_) * static_cast<size_t>(side_);
  cells_.assign(count, kUnknown);
  moved_.resize(count);
  observed_.resize(count);
  touched_.reserve(count);
}

OccupancyMap::Cell OccupancyMap::cell_of(double x_m, double y_m) const {
  return {static_cast<int64_t>(std::floor(x_m / p_.cell_m)), static_cast<int64_t>(std::floor(y_m / p_.cell_m))};
}

void OccupancyMap::centre(double x_m, double y_m) {
  const Cell middle = cell_of(x_m, y_m);
  const int64_t right = middle.column - side_ / 2 - column_, up = middle.row - side_ / 2 - row_;
  if (right == 0 && up == 0) return;
  column_ += right;
  row_ += up;
  std::fill(moved_.begin(), moved_.end(), kUnknown);
  const int64_t first = std::max<int64_t>(0, -right), last = std::min<int64_t>(side_, side_ - right);
  for (int64_t row = std::max<int64_t>(0, -up); first < last && row < std::min<int64_t>(side_, side_ - up); ++row)
    std::copy_n(cells_.begin() + (row + up) * side_ + first + right, last - first,
                moved_.begin() + row * side_ + first);
  cells_.swap(moved_);
}

bool OccupancyMap::resume(ImageView<const int16_t> cells, double x_m, double y_m) {
  if (cells.width != side_ || cells.height != side_) return false;
  column_ = std::llround(x_m / p_.cell_m);
  row_ = std::llround(y_m / p_.cell_m);
  std::copy_n(cells.data, cells_.size(), cells_.begin());
  return true;
}

void OccupancyMap::observe(const Cell& cell, uint8_t what) {
  const int64_t column = cell.column - column_, row = cell.row - row_;
  if (std::min(column, row) < 0 || std::max(column, row) >= side_) return;
  const auto at = static_cast<size_t>(row * side_ + column);
  if (observed_[at] == 0) touched_.push_back(at);  // within the reserved capacity: each cell once
  observed_[at] = std::max(observed_[at], what);
}

/// All cells of the digital line from one cell to another, the last one left out.
void OccupancyMap::pass(const Cell& from, const Cell& to) {
  const int64_t columns = to.column - from.column, rows = to.row - from.row;
  const int64_t steps = std::max(std::abs(columns), std::abs(rows));
  for (int64_t k = 0; k < steps; ++k)
    observe({from.column + rounded(k * columns, steps), from.row + rounded(k * rows, steps)}, kPassed);
}

void OccupancyMap::add(const PlanarPose& robot_in_map, const Sweep& sweep) {
  const PlanarPose sensor = compose(robot_in_map, sweep.sensor_in_robot);
  const Cell from = cell_of(sensor.x_m, sensor.y_m);
  for (size_t i = 0; i < sweep.range_m.size(); ++i) {
    const double range = sweep.range_m[i];
    if (!(range > 0)) continue;
    const double angle = sensor.theta_rad + sweep.first_angle_rad + static_cast<double>(i) * sweep.step_rad;
    const double length = std::min(range, p_.range_max_m);
    const Cell to = cell_of(sensor.x_m - length * std::sin(angle), sensor.y_m + length * std::cos(angle));
    pass(from, to);
    if (range <= p_.range_max_m) observe(to, kEnded);
  }
  for (const size_t at : touched_) {
    const int before = cells_[at] == kUnknown ? kOccupied / 2 : cells_[at];
    const int after = observed_[at] == kEnded ? before + p_.up : before - p_.down;
    cells_[at] = static_cast<int16_t>(std::clamp<int>(after, kFree, kOccupied));
    observed_[at] = 0;
  }
  touched_.clear();
}

}  // namespace takt::scan_matching
