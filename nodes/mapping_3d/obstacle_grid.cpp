// SPDX-License-Identifier: Apache-2.0
#include "nodes/mapping_3d/obstacle_grid.hpp"

#include <algorithm>
#include <cmath>

namespace takt::mapping_3d {

ObstacleGrid::ObstacleGrid(const ObstacleParameters& parameters) : p_(parameters) {
  const int half = static_cast<int>(std::ceil((p_.range_max_m + p_.margin_m) / p_.voxel_m - 1e-9));
  shape_ = {2 * half, -half * p_.voxel_m, p_.voxel_m};
  layers_ = std::max(1, static_cast<int>(std::ceil(p_.robot_height_m / p_.voxel_m - 1e-9)));
  const auto columns = static_cast<size_t>(shape_.cells) * static_cast<size_t>(shape_.cells);
  counts_.resize(columns * static_cast<size_t>(layers_));
  blocked_.resize(counts_.size());
  seen_.resize(columns);
}

void ObstacleGrid::count(std::span<const Point> points, const Affine& camera) {
  std::fill(counts_.begin(), counts_.end(), 0u);
  std::fill(seen_.begin(), seen_.end(), 0u);
  const double* r = camera.r;
  for (const Point& p : points) {
    const double x = p.x, y = p.y, z = p.z;
    int column, row;
    if (!shape_.cell_of(r[0] * x + r[1] * y + r[2] * z + camera.t[0], r[3] * x + r[4] * y + r[5] * z + camera.t[1],
                        column, row))
      continue;
    ++seen_[static_cast<size_t>(row) * static_cast<size_t>(shape_.cells) + static_cast<size_t>(column)];
    const int layer = layer_of(r[6] * x + r[7] * y + r[8] * z + camera.t[2]);
    if (layer >= 0) ++counts_[voxel(column, row, layer)];
  }
}

int ObstacleGrid::layer_of(double z) const {
  if (!(z >= p_.z_floor_m && z >= 0 && z < layers_ * p_.voxel_m)) return -1;
  return std::min(layers_ - 1, static_cast<int>(z * (1 / p_.voxel_m)));
}

bool ObstacleGrid::blocked_at(double x, double y, double z) const {
  int column, row;
  if (!shape_.cell_of(x, y, column, row)) return false;
  const int layer = layer_of(z);
  return layer >= 0 && blocked_[voxel(column, row, layer)] != 0;
}

// Point density falls with 1/Z^2, so the threshold follows what a fully covered voxel face would give.
bool ObstacleGrid::mark_blocked(int column, int row, const Affine& camera, double focal_px) {
  bool any = false;
  for (int layer = 0; layer < layers_; ++layer) {
    const uint32_t n = counts_[voxel(column, row, layer)];
    uint8_t& blocked = blocked_[voxel(column, row, layer)];
    blocked = 0;
    if (n <= static_cast<uint32_t>(p_.n_abs)) continue;
    const double dx = shape_.origin_m + (column + 0.5) * p_.voxel_m - camera.t[0];
    const double dy = shape_.origin_m + (row + 0.5) * p_.voxel_m - camera.t[1];
    const double dz = (layer + 0.5) * p_.voxel_m - camera.t[2];
    const double depth = std::max(0.5 * p_.voxel_m, camera.r[2] * dx + camera.r[5] * dy + camera.r[8] * dz);
    const double edge_px = p_.voxel_m * focal_px / depth;
    blocked = n > p_.share * edge_px * edge_px;
    any |= blocked != 0;
  }
  return any;
}

bool ObstacleGrid::in_view(double x, double y, const Affine& camera, double half_view_rad) const {
  const double dx = x - camera.t[0], dy = y - camera.t[1];
  const double range = std::sqrt(dx * dx + dy * dy);
  if (range < p_.range_min_m || range > p_.range_max_m) return false;
  const double ax = camera.r[2], ay = camera.r[5];  // optical axis seen from above
  return std::abs(std::atan2(ax * dy - ay * dx, ax * dx + ay * dy)) <= half_view_rad;
}

// Whether the straight line from the camera to the cell's centre crosses a blocked cell before it gets there.
bool ObstacleGrid::hidden(int column, int row, const Affine& camera, ImageView<int16_t> cells) const {
  const double u0 = (camera.t[0] - shape_.origin_m) / p_.voxel_m, v0 = (camera.t[1] - shape_.origin_m) / p_.voxel_m;
  const double du = column + 0.5 - u0, dv = row + 0.5 - v0;
  const int steps = static_cast<int>(std::ceil(4 * std::max(std::abs(du), std::abs(dv))));
  for (int i = 0; i < steps; ++i) {
    const double share = static_cast<double>(i) / steps;
    const int u = static_cast<int>(std::floor(u0 + share * du)), v = static_cast<int>(std::floor(v0 + share * dv));
    if (u == column && v == row) return false;
    if (cells.contains(u, v) && cells.at(u, v) == kOccupied) return true;
  }
  return false;
}

void ObstacleGrid::fill(std::span<const Point> points, const Viewpoint& viewpoint, ImageView<int16_t> cells) {
  const Affine camera = to_affine(viewpoint.camera_in_robot);
  count(points, camera);
  for (int row = 0; row < shape_.cells; ++row)
    for (int column = 0; column < shape_.cells; ++column)
      cells.at(column, row) = mark_blocked(column, row, camera, viewpoint.focal_px) ? kOccupied : kUnknown;
  for (int row = 0; row < shape_.cells; ++row)
    for (int column = 0; column < shape_.cells; ++column) {
      if (cells.at(column, row) == kOccupied) continue;
      const double x = shape_.origin_m + (column + 0.5) * p_.voxel_m, y = shape_.origin_m + (row + 0.5) * p_.voxel_m;
      const auto index = static_cast<size_t>(row) * static_cast<size_t>(shape_.cells) + static_cast<size_t>(column);
      if (p_.evidence && seen_[index] == 0) continue;
      if (in_view(x, y, camera, viewpoint.half_view_rad) && !hidden(column, row, camera, cells))
        cells.at(column, row) = kFree;
    }
}

void merge(ImageView<const int16_t> newer, ImageView<int16_t> into) {
  for (int row = 0; row < into.height; ++row)
    for (int column = 0; column < into.width; ++column) {
      int16_t& cell = into.at(column, row);
      cell = std::max(cell, newer.at(column, row));  // unknown is -1, below every known value
    }
}

}  // namespace takt::mapping_3d
