// SPDX-License-Identifier: Apache-2.0
#include "nodes/traversability/height_map.hpp"

#include <algorithm>
#include <cmath>

namespace takt::traversability {
namespace {

constexpr double kLeastSpread = 0.1;  // of the points of a plane in each direction, share of a cell

// The scanner does not see what lies right below an edge: so many cells on, at most, the floor goes on.
constexpr int kShadow = 2;

}  // namespace

HeightMap::HeightMap(const HeightParameters& parameters) : p_(parameters), cells_(p_.window_m, p_.cell_m, Cell{}) {}

void HeightMap::add(std::span<const mapping_3d::Position> points, int64_t stamp_ns) {
  for (const mapping_3d::Position& p : points) {
    if (p.z_m > p_.robot_height_m) continue;
    const int64_t column = cells_.column_of(p.x_m), row = cells_.row_of(p.y_m);
    if (!cells_.contains(column, row)) continue;
    Cell& c = cells_.at(column, row);
    if (c.n > 0 && stamp_ns - c.seen_ns > p_.forget_ns) c = {};
    const double x = p.x_m - origin_x_m() - (static_cast<double>(column) + 0.5) * p_.cell_m,
                 y = p.y_m - origin_y_m() - (static_cast<double>(row) + 0.5) * p_.cell_m, z = p.z_m;
    c.low = c.n > 0 ? std::min(c.low, z) : z;
    c.high = c.n > 0 ? std::max(c.high, z) : z;
    c.n += 1;
    c.x += x;
    c.y += y;
    c.z += z;
    c.xx += x * x;
    c.xy += x * y;
    c.yy += y * y;
    c.xz += x * z;
    c.yz += y * z;
    c.seen_ns = stamp_ns;
  }
}

Surface HeightMap::surface(int column, int row) const {
  const Cell& c = cells_.at(column, row);
  if (c.n < p_.points_min) return {};
  Surface out{true, c.z / c.n, c.high - c.low, 0};
  // Least squares z = a x + b y + m about the means.
  const double xx = c.xx - c.x * c.x / c.n, xy = c.xy - c.x * c.y / c.n, yy = c.yy - c.y * c.y / c.n;
  const double xz = c.xz - c.x * c.z / c.n, yz = c.yz - c.y * c.z / c.n;
  const double det = xx * yy - xy * xy, least = c.n * kLeastSpread * p_.cell_m * kLeastSpread * p_.cell_m;
  if (det > least * least) out.slope = std::hypot(xz * yy - yz * xy, yz * xx - xz * xy) / det;
  return out;
}

bool HeightMap::blocked(const Surface& s, int column, int row) const {
  if (s.range_m > p_.step_m || s.slope > p_.slope) return true;
  constexpr int kDirections[][2] = {{-1, 0}, {1, 0}, {0, -1}, {0, 1}};
  return std::any_of(std::begin(kDirections), std::end(kDirections), [&](const int(&to)[2]) {
    for (int cells = 1; cells <= kShadow; ++cells) {
      const int c = column + cells * to[0], r = row + cells * to[1];
      if (!cells_.contains(c, r)) return false;
      const Surface beside = surface(c, r);
      if (beside.known) return std::abs(beside.mean_m - s.mean_m) > std::max(p_.step_m, p_.slope * cells * p_.cell_m);
    }
    return false;
  });
}

void HeightMap::judge(ImageView<int16_t> cells) const {
  for (int row = 0; row < side(); ++row)
    for (int column = 0; column < side(); ++column) {
      const Surface s = surface(column, row);
      cells.at(column, row) = !s.known ? kUnknown : blocked(s, column, row) ? kBlocked : kFree;
    }
}

}  // namespace takt::traversability
