// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <map>
#include <random>
#include <tuple>
#include <vector>

#include "nodes/mapping_3d/obstacle_grid.hpp"

using namespace takt::mapping_3d;
using takt::Point;

namespace {

/// Occupied cells the slow way: a map from voxel to points, every rule written out once more.
std::map<std::pair<int, int>, bool> occupied_reference(const std::vector<Point>& points, const Viewpoint& view,
                                                       const ObstacleParameters& p, const GridShape& shape) {
  const Affine m = to_affine(view.camera_in_robot);
  std::map<std::tuple<int, int, int>, int> voxels;
  for (const Point& q : points) {
    const double c[3] = {q.x, q.y, q.z};
    double r[3];
    for (int i = 0; i < 3; ++i) r[i] = m.r[3 * i] * c[0] + m.r[3 * i + 1] * c[1] + m.r[3 * i + 2] * c[2] + m.t[i];
    if (r[2] < p.z_floor_m || r[2] < 0 || r[2] >= std::ceil(p.robot_height_m / p.voxel_m) * p.voxel_m) continue;
    const double inverse = 1 / p.voxel_m;
    ++voxels[{static_cast<int>(std::floor((r[0] - shape.origin_m) * inverse)),
              static_cast<int>(std::floor((r[1] - shape.origin_m) * inverse)),
              static_cast<int>(std::floor(r[2] * inverse))}];
  }
  std::map<std::pair<int, int>, bool> occupied;
  for (const auto& [voxel, count] : voxels) {
    const auto [column, row, layer] = voxel;
    const double centre[3] = {shape.origin_m + (column + 0.5) * p.voxel_m - m.t[0],
                              shape.origin_m + (row + 0.5) * p.voxel_m - m.t[1], (layer + 0.5) * p.voxel_m - m.t[2]};
    const double depth = std::max(0.5 * p.voxel_m, m.r[2] * centre[0] + m.r[5] * centre[1] + m.r[8] * centre[2]);
    const double expected = std::pow(p.voxel_m * view.focal_px / depth, 2);
    if (count > p.n_abs && count > p.share * expected) occupied[{column, row}] = true;
  }
  return occupied;
}

}  // namespace

TEST_CASE("occupied cells equal those of a map of voxels; a free cell is never occupied") {
  std::mt19937 random(1);
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution<>(low, high)(random); };
  for (int round = 0; round < 40; ++round) {
    ObstacleParameters p;
    p.voxel_m = uniform(0.1, 0.4);
    p.share = uniform(0.01, 0.3);
    const double step_px = uniform(1, 6);
    ObstacleGrid grid(p);
    const GridShape shape = grid.shape();
    const Viewpoint view{camera_mount(uniform(-0.3, 0.3), uniform(-0.3, 0.5), 1.6, uniform(-1, 1), uniform(-0.6, 0.2)),
                         492.8 / step_px, 0.57};
    std::vector<Point> points;
    for (int blob = 0; blob < 40; ++blob) {
      const Point centre{static_cast<float>(uniform(-3, 3)), static_cast<float>(uniform(-1.5, 1.5)),
                         static_cast<float>(uniform(0.5, 8))};
      for (int i = static_cast<int>(uniform(1, 400)); i > 0; --i)
        points.push_back({centre.x + static_cast<float>(uniform(-0.2, 0.2)),
                          centre.y + static_cast<float>(uniform(-0.2, 0.2)),
                          centre.z + static_cast<float>(uniform(-0.2, 0.2))});
    }
    std::vector<int16_t> cells(static_cast<size_t>(shape.cells * shape.cells), 77);
    grid.fill(points, view, {cells.data(), shape.cells, shape.cells});
    const auto occupied = occupied_reference(points, view, p, shape);
    bool equal = true;
    for (int row = 0; row < shape.cells; ++row)
      for (int column = 0; column < shape.cells; ++column) {
        const int16_t cell = cells[static_cast<size_t>(row * shape.cells + column)];
        equal &= (cell == kOccupied) == occupied.contains({column, row});
        equal &= cell == kOccupied || cell == kFree || cell == kUnknown;
      }
    CHECK(equal);
  }
}
