// SPDX-License-Identifier: Apache-2.0
#include "nodes/ground_map/specks.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace takt::ground_map {

Specks::Specks(int cells, int most) : most_(most) {
  visited_.resize(static_cast<size_t>(cells) * static_cast<size_t>(cells));
  island_.reserve(visited_.size());
}

bool Specks::grow(ImageView<const int16_t> cells, int first) {
  const auto blocked = [&](int x, int y) { return cells.at(x, y) > kOccupied / 2; };
  if (!blocked(first % cells.width, first / cells.width)) return false;
  bool amid_known = true;
  island_.assign(1, first);
  visited_[static_cast<size_t>(first)] = 1;
  for (size_t next = 0; next < island_.size(); ++next) {
    const int x = island_[next] % cells.width, y = island_[next] / cells.width;
    for (int v = y - 1; v <= y + 1; ++v)
      for (int u = x - 1; u <= x + 1; ++u) {
        amid_known = amid_known && cells.contains(u, v) && cells.at(u, v) != kUnknown;
        if (!cells.contains(u, v) || !blocked(u, v)) continue;
        uint8_t& visited = visited_[static_cast<size_t>(v * cells.width + u)];
        if (!visited) island_.push_back(v * cells.width + u);
        visited = 1;
      }
  }
  return amid_known && island_.size() <= static_cast<size_t>(most_);
}

bool sees_past(const LaserScan& scan, const FloorPoint& cell, double cell_m) {
  const PlanarPose at = between(planar(scan.sensor_in_robot), {cell.x_m, cell.y_m, 0});
  const double half_m = cell_m / std::numbers::sqrt2, range = std::hypot(at.x_m, at.y_m);
  if (!(range > half_m) || !(scan.step_rad > 0)) return false;
  // Counter-clockwise from the forward axis y.
  const double angle = std::atan2(-at.x_m, at.y_m), aside = std::asin(half_m / range);
  const double first = std::floor((angle - aside - scan.first_angle_rad) / scan.step_rad),
               last = std::ceil((angle + aside - scan.first_angle_rad) / scan.step_rad);
  if (!(first >= 0 && last < static_cast<double>(scan.range_m.size))) return false;
  for (auto beam = static_cast<uint32_t>(first); beam <= static_cast<uint32_t>(last); ++beam) {
    const double seen = scan.range_m[beam];
    if (!(seen == 0 || seen > range + half_m)) return false;  // NaN as well
  }
  return true;
}

}  // namespace takt::ground_map
