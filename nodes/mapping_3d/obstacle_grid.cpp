// SPDX-License-Identifier: Apache-2.0
#include "nodes/mapping_3d/obstacle_grid.hpp"

#include <algorithm>
#include <cmath>

namespace takt::mapping_3d {
namespace {

constexpr double kLowest_m = 0.02;  // points that lie so little above the lowest of a cell tell its floor

double axis(const Affine& a, int row, const Point& p) {
  return a.r[3 * row] * p.x + a.r[3 * row + 1] * p.y + a.r[3 * row + 2] * p.z + a.t[row];
}

}  // namespace

ObstacleGrid::ObstacleGrid(const ObstacleParameters& parameters) : p_(parameters) {
  const int half = static_cast<int>(std::ceil((p_.range_max_m + p_.margin_m) / p_.voxel_m - 1e-9));
  shape_ = {2 * half, -half * p_.voxel_m, p_.voxel_m};
  layers_ = std::max(1, static_cast<int>(std::ceil(p_.robot_height_m / p_.voxel_m - 1e-9)));
  const auto columns = static_cast<size_t>(shape_.cells) * static_cast<size_t>(shape_.cells);
  counts_.resize(columns * static_cast<size_t>(layers_));
  blocked_.resize(counts_.size());
  seen_.resize(columns);
  floor_.resize(columns);
  plan_steps();
}

void ObstacleGrid::tune(ObstacleParameters parameters) {
  parameters.voxel_m = p_.voxel_m;
  parameters.robot_height_m = p_.robot_height_m;
  parameters.range_max_m = p_.range_max_m;
  parameters.margin_m = p_.margin_m;
  p_ = parameters;
}

void ObstacleGrid::plan_steps() {
  const double middle = shape_.cells / 2.0;
  for (int row = 0; row < shape_.cells; ++row)
    for (int column = 0; column < shape_.cells; ++column) {
      const double x = column + 0.5 - middle, y = row + 0.5 - middle, longer = std::max(std::abs(x), std::abs(y));
      if (longer < 1) continue;  // the robot stands there
      const int c = static_cast<int>(std::floor(x - x / longer + middle));
      const int r = static_cast<int>(std::floor(y - y / longer + middle));
      Step step{cell(column, row), {}, std::hypot(x, y) / longer * p_.voxel_m};
      step.before.fill(cell(c, r));
      const int across = std::abs(x) >= std::abs(y) ? 0 : 1;  // sides lie across the longer axis
      for (size_t side = 0; side < 2; ++side) {
        const int away = side == 0 ? -1 : 1, to_c = c + across * away, to_r = r + (1 - across) * away;
        if (std::max(std::abs(to_c + 0.5 - middle), std::abs(to_r + 0.5 - middle)) < longer)
          step.before[1 + side] = cell(to_c, to_r);
      }
      steps_.push_back(step);
    }
  const auto ring = [&](const Step& step) {
    const auto away = [&](size_t at) { return std::abs(static_cast<double>(at) + 0.5 - middle); };
    const auto side = static_cast<size_t>(shape_.cells);
    return std::max(away(step.cell % side), away(step.cell / side));
  };
  std::stable_sort(steps_.begin(), steps_.end(), [&](const Step& a, const Step& b) { return ring(a) < ring(b); });
}

void ObstacleGrid::follow_floor(std::span<const Point> points, const Affine& camera) {
  std::fill(floor_.begin(), floor_.end(), Floor{});
  if (p_.slope <= 0) return;
  const auto for_each = [&](const auto& visit) {
    for (const Point& p : points) {
      int column, row;
      if (shape_.cell_of(axis(camera, 0, p), axis(camera, 1, p), column, row))
        visit(floor_[cell(column, row)], axis(camera, 2, p));
    }
  };
  for_each([](Floor& floor, double z) { floor.lowest_m = floor.points++ > 0 ? std::min(floor.lowest_m, z) : z; });
  for (Floor& floor : floor_) floor.points = 0;
  for_each([](Floor& floor, double z) {
    if (z <= floor.lowest_m + kLowest_m) floor.sum_m += z, ++floor.points;
  });
  for (const Step& step : steps_) {
    Floor& here = floor_[step.cell];
    const size_t latest = *std::min_element(step.before.begin(), step.before.end(),
                                            [&](size_t a, size_t b) { return floor_[a].unseen < floor_[b].unseen; });
    const Floor& before = floor_[latest];
    const double climb = std::min(p_.z_floor_m, p_.slope * step.length_m * (before.unseen + 1));
    here.height_m = before.height_m;
    here.unseen = before.unseen + 1;
    if (here.points == 0 || std::abs(here.sum_m / here.points - before.height_m) > climb) continue;
    here.height_m = here.sum_m / here.points;
    here.unseen = 0;
  }
}

void ObstacleGrid::count(std::span<const Point> points, const Affine& camera) {
  std::fill(counts_.begin(), counts_.end(), 0u);
  std::fill(seen_.begin(), seen_.end(), 0u);
  for (const Point& p : points) {
    int column, row;
    if (!shape_.cell_of(axis(camera, 0, p), axis(camera, 1, p), column, row)) continue;
    const size_t at = cell(column, row);
    ++seen_[at];
    const int layer = layer_of(axis(camera, 2, p) - floor_[at].height_m);
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
  const int layer = layer_of(z - floor_[cell(column, row)].height_m);
  return layer >= 0 && blocked_[voxel(column, row, layer)] != 0;
}

// Point density falls with 1/Z^2, so the threshold follows what a fully covered voxel face would give.
bool ObstacleGrid::mark_blocked(int column, int row, const Affine& camera, const Viewpoint& viewpoint) {
  const bool laser = viewpoint.sensor == Sensor::laser;
  const double floor_m = floor_[cell(column, row)].height_m;
  bool any = false;
  for (int layer = 0; layer < layers_; ++layer) {
    const uint32_t n = counts_[voxel(column, row, layer)];
    uint8_t& blocked = blocked_[voxel(column, row, layer)];
    blocked = 0;
    if (n <= static_cast<uint32_t>(p_.n_abs)) continue;
    const double dx = shape_.origin_m + (column + 0.5) * p_.voxel_m - camera.t[0];
    const double dy = shape_.origin_m + (row + 0.5) * p_.voxel_m - camera.t[1];
    const double dz = floor_m + (layer + 0.5) * p_.voxel_m - camera.t[2];
    const double away = laser ? std::hypot(dx, dy, dz) : camera.r[2] * dx + camera.r[5] * dy + camera.r[8] * dz;
    const double edge_px = p_.voxel_m * viewpoint.focal_px / std::max(0.5 * p_.voxel_m, away);
    blocked = n > p_.share * (laser ? edge_px : edge_px * edge_px);
    any |= blocked != 0;
  }
  return any;
}

bool ObstacleGrid::in_view(double x, double y, const Affine& camera, const Viewpoint& viewpoint) const {
  const double dx = x - camera.t[0], dy = y - camera.t[1];
  const double range = std::sqrt(dx * dx + dy * dy);
  if (range < p_.range_min_m || range > p_.range_max_m) return false;
  const int ahead = viewpoint.sensor == Sensor::laser ? 1 : 2;
  const double ax = camera.r[ahead], ay = camera.r[3 + ahead];  // where it looks, seen from above
  return std::abs(std::atan2(ax * dy - ay * dx, ax * dx + ay * dy)) <= viewpoint.half_view_rad;
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
  follow_floor(points, camera);
  count(points, camera);
  for (int row = 0; row < shape_.cells; ++row)
    for (int column = 0; column < shape_.cells; ++column)
      cells.at(column, row) = mark_blocked(column, row, camera, viewpoint) ? kOccupied : kUnknown;
  for (int row = 0; row < shape_.cells; ++row)
    for (int column = 0; column < shape_.cells; ++column) {
      if (cells.at(column, row) == kOccupied) continue;
      const double x = shape_.origin_m + (column + 0.5) * p_.voxel_m, y = shape_.origin_m + (row + 0.5) * p_.voxel_m;
      if (p_.evidence && seen_[cell(column, row)] == 0) continue;
      if (in_view(x, y, camera, viewpoint) && !hidden(column, row, camera, cells)) cells.at(column, row) = kFree;
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
