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
    : p_(parameters), cells_(p_.window_m, p_.cell_m, kUnknown), observed_(cells_.cells().size()) {
  touched_.reserve(observed_.size());
}

OccupancyMap::Cell OccupancyMap::cell_of(double x_m, double y_m) const {
  return {cells_.column_of(x_m), cells_.row_of(y_m)};
}

bool OccupancyMap::resume(ImageView<const int16_t> cells, double x_m, double y_m) {
  if (cells.width != side() || cells.height != side()) return false;
  cells_.lay_at(x_m, y_m);
  std::copy_n(cells.data, cells_.cells().size(), cells_.cells().begin());
  return true;
}

void OccupancyMap::observe(const Cell& cell, uint8_t what) {
  if (!cells_.contains(cell.column, cell.row)) return;
  const size_t at = cells_.index(cell.column, cell.row);
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
    int16_t& cell = cells_.cells()[at];
    const int before = cell == kUnknown ? kOccupied / 2 : cell;
    const int after = observed_[at] == kEnded ? before + p_.up : before - p_.down;
    cell = static_cast<int16_t>(std::clamp<int>(after, kFree, kOccupied));
    observed_[at] = 0;
  }
  touched_.clear();
}

}  // namespace takt::scan_matching
