// SPDX-License-Identifier: Apache-2.0
#include "nodes/traversability/height_map.hpp"

#include <algorithm>
#include <cmath>

#include "rt/transform/pose_math.hpp"

namespace takt::traversability {
namespace {

constexpr double kLeastSpread = 0.1;  // of the points of a plane in each direction, share of a cell

// The scanner does not see what lies right below an edge: so many cells on, at most, the floor goes on.
constexpr int kShadow = 2;

int cell_of(double offset_m, double cell_m) { return static_cast<int>(std::floor(offset_m / cell_m)); }

void merge(int16_t other, int16_t& cell) { cell = std::max(cell, other); }  // unknown is less than all

}  // namespace

HeightMap::HeightMap(const HeightParameters& parameters)
    : p_(parameters),
      side_(2 * static_cast<int>(std::ceil(p_.window_m / 2 / p_.cell_m - 1e-9))),
      column_(-side_ / 2),
      row_(-side_ / 2),
      cells_(static_cast<size_t>(side_) * static_cast<size_t>(side_)),
      moved_(cells_.size()) {}

void HeightMap::centre(double x_m, double y_m) {
  const int64_t right = cell_of(x_m, p_.cell_m) - side_ / 2 - column_, up = cell_of(y_m, p_.cell_m) - side_ / 2 - row_;
  if (right == 0 && up == 0) return;
  column_ += right;
  row_ += up;
  for (int64_t row = 0; row < side_; ++row)
    for (int64_t column = 0; column < side_; ++column) {
      const int64_t c = column + right, r = row + up;
      const bool inside = std::min(c, r) >= 0 && std::max(c, r) < side_;
      moved_[index(column, row)] = inside ? cells_[index(c, r)] : Cell{};
    }
  cells_.swap(moved_);
}

void HeightMap::add(std::span<const mapping_3d::Position> points, int64_t stamp_ns) {
  for (const mapping_3d::Position& p : points) {
    if (p.z_m > p_.robot_height_m) continue;
    const int64_t column = cell_of(p.x_m, p_.cell_m) - column_, row = cell_of(p.y_m, p_.cell_m) - row_;
    if (std::min(column, row) < 0 || std::max(column, row) >= side_) continue;
    Cell& c = cells_[index(column, row)];
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
  const Cell& c = cells_[index(column, row)];
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
      if (std::min(c, r) < 0 || std::max(c, r) >= side_) return false;
      const Surface beside = surface(c, r);
      if (beside.known) return std::abs(beside.mean_m - s.mean_m) > std::max(p_.step_m, p_.slope * cells * p_.cell_m);
    }
    return false;
  });
}

void HeightMap::judge(ImageView<int16_t> cells) const {
  for (int row = 0; row < side_; ++row)
    for (int column = 0; column < side_; ++column) {
      const Surface s = surface(column, row);
      cells.at(column, row) = !s.known ? kUnknown : blocked(s, column, row) ? kBlocked : kFree;
    }
}

void fuse(const Grid& other, double origin_x_m, double origin_y_m, double cell_m, ImageView<int16_t> into) {
  const mapping_3d::Affine to_map = mapping_3d::to_affine(other.grid_in_map);
  const mapping_3d::Affine to_other = mapping_3d::to_affine(inverse(UncertainPose{other.grid_in_map, {}}).transform);
  const ImageView<const int16_t> cells = other.view();
  // From each side once: the finer grid has several cells in one of the other.
  for (int row = 0; row < cells.height; ++row)
    for (int column = 0; column < cells.width; ++column) {
      const mapping_3d::Position p = transformed(to_map, other.origin_x_m + (column + 0.5) * other.cell_m,
                                                 other.origin_y_m + (row + 0.5) * other.cell_m, 0);
      const int c = cell_of(p.x_m - origin_x_m, cell_m), r = cell_of(p.y_m - origin_y_m, cell_m);
      if (std::min(c, r) >= 0 && c < into.width && r < into.height) merge(cells.at(column, row), into.at(c, r));
    }
  for (int row = 0; row < into.height; ++row)
    for (int column = 0; column < into.width; ++column) {
      const mapping_3d::Position p =
          transformed(to_other, origin_x_m + (column + 0.5) * cell_m, origin_y_m + (row + 0.5) * cell_m, 0);
      const int c = cell_of(p.x_m - other.origin_x_m, other.cell_m),
                r = cell_of(p.y_m - other.origin_y_m, other.cell_m);
      if (std::min(c, r) >= 0 && c < cells.width && r < cells.height) merge(cells.at(c, r), into.at(column, row));
    }
}

}  // namespace takt::traversability
