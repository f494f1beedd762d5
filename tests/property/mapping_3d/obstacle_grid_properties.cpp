// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <random>
#include <set>
#include <tuple>
#include <vector>

#include "nodes/mapping_3d/grid_window.hpp"
#include "nodes/mapping_3d/obstacle_grid.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/point.hpp"
#include "tests/property_scale.hpp"

using namespace takt::mapping_3d;
using takt::Point;

namespace {

using Voxel = std::tuple<int, int, int>;  // column, row, layer

Eigen::Isometry3d isometry(const takt::Transform& t) {
  Eigen::Isometry3d i = Eigen::Isometry3d::Identity();
  i.linear() = Eigen::Quaterniond(t.qw, t.qx, t.qy, t.qz).toRotationMatrix();
  i.translation() = Eigen::Vector3d(t.x, t.y, t.z);
  return i;
}

/// Floors the slow way: each cell asks the one before it on the way from the robot and those at its sides, and takes
/// the one whose floor was seen last.
struct Floor {
  double height = 0;
  int unseen = 0;
};
class Floors {
 public:
  using Place = std::pair<int, int>;
  Floors(const std::map<Place, std::vector<double>>& heights, const ObstacleParameters& p, const GridShape& shape)
      : heights_(heights), p_(p), middle_(shape.cells / 2.0) {}

  Floor at(const Place& place) {
    if (!known_.contains(place)) known_[place] = find(place);
    return known_[place];
  }

 private:
  double away(const Place& place) const {
    return std::max(std::abs(place.first + 0.5 - middle_), std::abs(place.second + 0.5 - middle_));
  }
  Floor find(const Place& place) {
    const double x = place.first + 0.5 - middle_, y = place.second + 0.5 - middle_, longer = away(place);
    if (p_.slope == 0 || longer < 1) return {};
    const Place before{static_cast<int>(std::floor(x - x / longer + middle_)),
                       static_cast<int>(std::floor(y - y / longer + middle_))};
    Floor floor = at(before);
    for (const int side : {-1, 1}) {
      const Place beside = std::abs(x) >= std::abs(y) ? Place{before.first, before.second + side}
                                                      : Place{before.first + side, before.second};
      if (away(beside) < longer && at(beside).unseen < floor.unseen) floor = at(beside);
    }
    const double climb =
        std::min(p_.z_floor_m, p_.slope * (std::hypot(x, y) / longer * p_.voxel_m) * (floor.unseen + 1));
    ++floor.unseen;
    const auto here = heights_.find(place);
    if (here == heights_.end()) return floor;
    const double lowest = *std::min_element(here->second.begin(), here->second.end());
    double sum = 0;
    int count = 0;
    for (const double z : here->second)
      if (z <= lowest + 0.02) sum += z, ++count;
    if (std::abs(sum / count - floor.height) > climb) return floor;
    return {sum / count, 0};
  }

  const std::map<Place, std::vector<double>>& heights_;
  const ObstacleParameters& p_;
  double middle_;
  std::map<Place, Floor> known_;
};

/// The points (robot frame) in blocked voxels the slow way: a map from voxel to points, every rule written out once
/// more.
std::map<Voxel, std::vector<Eigen::Vector3d>> blocked_reference(const std::vector<Point>& points, const Viewpoint& view,
                                                                const ObstacleParameters& p, const GridShape& shape) {
  const Affine m = to_affine(view.camera_in_robot);
  std::map<std::pair<int, int>, std::vector<Eigen::Vector3d>> columns;
  std::map<std::pair<int, int>, std::vector<double>> heights;
  const double inverse = 1 / p.voxel_m;
  for (const Point& q : points) {
    const double c[3] = {q.x, q.y, q.z};
    double r[3];
    for (int i = 0; i < 3; ++i) r[i] = m.r[3 * i] * c[0] + m.r[3 * i + 1] * c[1] + m.r[3 * i + 2] * c[2] + m.t[i];
    const std::pair column{static_cast<int>(std::floor((r[0] - shape.origin_m) * inverse)),
                           static_cast<int>(std::floor((r[1] - shape.origin_m) * inverse))};
    const auto outside = [&](int i) { return i < 0 || i >= shape.cells; };
    if (outside(column.first) || outside(column.second)) continue;
    columns[column].emplace_back(r[0], r[1], r[2]);
    heights[column].push_back(r[2]);
  }
  std::map<Voxel, std::vector<Eigen::Vector3d>> voxels;
  Floors floors(heights, p, shape);
  for (const auto& [column, in_it] : columns) {
    for (const Eigen::Vector3d& r : in_it) {
      const double height = r.z() - floors.at(column).height;
      if (height < p.z_floor_m || height >= std::ceil(p.robot_height_m / p.voxel_m) * p.voxel_m) continue;
      voxels[{column.first, column.second, static_cast<int>(std::floor(height * inverse))}].push_back(r);
    }
  }
  std::erase_if(voxels, [&](const auto& entry) {
    const auto [column, row, layer] = entry.first;
    const double centre[3] = {shape.origin_m + (column + 0.5) * p.voxel_m - m.t[0],
                              shape.origin_m + (row + 0.5) * p.voxel_m - m.t[1],
                              floors.at({column, row}).height + (layer + 0.5) * p.voxel_m - m.t[2]};
    const double depth = std::max(0.5 * p.voxel_m, m.r[2] * centre[0] + m.r[5] * centre[1] + m.r[8] * centre[2]);
    const double expected = std::pow(p.voxel_m * view.focal_px / depth, 2);
    const auto count = static_cast<double>(entry.second.size());
    return !(count > p.n_abs && count > p.share * expected);
  });
  return voxels;
}

/// One cloud, and what it showed.
struct View {
  std::vector<Point> points;
  Viewpoint viewpoint;
  takt::Transform robot_in_map;
  std::vector<int16_t> cells;
};

/// The merged grid the slow way: for every view the points of blocked voxels, gathered by quarter of a cell, their
/// means moved from robot to robot; and for every cell of the new grid the cell of the old one under its centre.
std::vector<int16_t> merged_reference(const std::vector<View>& views, const ObstacleParameters& p,
                                      const GridShape& shape) {
  std::vector<int16_t> cells = views.back().cells;
  const auto index = [&](double x, double y) -> std::optional<size_t> {
    const double column = std::floor((x - shape.origin_m) / shape.cell_m),
                 row = std::floor((y - shape.origin_m) / shape.cell_m);
    if (column < 0 || column >= shape.cells || row < 0 || row >= shape.cells) return std::nullopt;
    return static_cast<size_t>(row * shape.cells + column);
  };
  for (size_t k = 0; k + 1 < views.size(); ++k) {
    const Eigen::Isometry3d move = isometry(views.back().robot_in_map).inverse() * isometry(views[k].robot_in_map);
    for (int row = 0; row < shape.cells; ++row)
      for (int column = 0; column < shape.cells; ++column) {
        const Eigen::Vector3d centre(shape.origin_m + (column + 0.5) * shape.cell_m,
                                     shape.origin_m + (row + 0.5) * shape.cell_m, 0);
        const Eigen::Vector3d before = move.inverse() * centre;
        const auto old = index(before.x(), before.y());
        int16_t& cell = cells[static_cast<size_t>(row * shape.cells + column)];
        if (old && views[k].cells[*old] == kFree && cell == kUnknown) cell = kFree;
      }
    std::map<std::pair<int, int>, std::vector<Eigen::Vector3d>> quarters;
    for (const auto& [voxel, points] : blocked_reference(views[k].points, views[k].viewpoint, p, shape))
      for (const Eigen::Vector3d& q : points)
        quarters[{static_cast<int>(std::floor((q.x() - shape.origin_m) / (shape.cell_m / 2))),
                  static_cast<int>(std::floor((q.y() - shape.origin_m) / (shape.cell_m / 2)))}]
            .push_back(q);
    for (const auto& [place, points] : quarters) {
      Eigen::Vector3d mean = Eigen::Vector3d::Zero();
      for (const Eigen::Vector3d& q : points) mean += q;
      mean = move * (mean / static_cast<double>(points.size()));
      if (const auto at = index(mean.x(), mean.y())) cells[*at] = kOccupied;
    }
  }
  return cells;
}

struct Random {
  std::mt19937 engine;
  double operator()(double low, double high) { return std::uniform_real_distribution<>(low, high)(engine); }
  /// Blobs before the camera.
  std::vector<Point> cloud(int blobs) {
    auto& uniform = *this;
    std::vector<Point> points;
    for (int blob = 0; blob < blobs; ++blob) {
      const Point centre{static_cast<float>(uniform(-3, 3)), static_cast<float>(uniform(-1.5, 1.5)),
                         static_cast<float>(uniform(0.5, 8))};
      for (int i = static_cast<int>(uniform(1, 400)); i > 0; --i)
        points.push_back({centre.x + static_cast<float>(uniform(-0.2, 0.2)),
                          centre.y + static_cast<float>(uniform(-0.2, 0.2)),
                          centre.z + static_cast<float>(uniform(-0.2, 0.2))});
    }
    return points;
  }
};

}  // namespace

TEST_CASE("occupied cells equal those of a map of voxels; a free cell is never occupied") {
  Random uniform{std::mt19937(takt::test::seed(1))};
  for (int round = 0; round < takt::test::rounds(40); ++round) {
    ObstacleParameters p;
    p.voxel_m = uniform(0.1, 0.4);
    p.share = uniform(0.01, 0.3);
    p.slope = round % 4 == 0 ? 0 : uniform(0.05, 2);
    p.z_floor_m = uniform(0.03, 0.3);
    const double step_px = uniform(1, 6);
    ObstacleGrid grid(p);
    const GridShape shape = grid.shape();
    const Viewpoint view{camera_mount(uniform(-0.3, 0.3), uniform(-0.3, 0.5), 1.6, uniform(-1, 1), uniform(-0.6, 0.2)),
                         492.8 / step_px, 0.57};
    const std::vector<Point> points = uniform.cloud(40);
    std::vector<int16_t> cells(static_cast<size_t>(shape.cells * shape.cells), 77);
    grid.fill(points, view, {cells.data(), shape.cells, shape.cells});
    std::set<std::pair<int, int>> occupied;
    for (const auto& [voxel, in_it] : blocked_reference(points, view, p, shape))
      occupied.emplace(std::get<0>(voxel), std::get<1>(voxel));
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

TEST_CASE("the merged grid of a window equals the one made from all its clouds, view by view and point by point") {
  Random uniform{std::mt19937(takt::test::seed(2))};
  size_t remembered = 0, opened = 0, lost = 0;
  for (int round = 0; round < takt::test::rounds(12); ++round) {
    CAPTURE(round);
    ObstacleParameters p;
    p.voxel_m = uniform(0.15, 0.3);
    p.share = uniform(0.01, 0.1);
    p.slope = uniform(0.05, 2);
    ObstacleGrid grid(p);
    const GridShape shape = grid.shape();
    const auto size = static_cast<size_t>(1 + round % 5);
    GridWindow window(static_cast<int>(size), shape);
    std::vector<View> kept;
    double x = uniform(-50, 50), y = uniform(-50, 50), heading = uniform(-3, 3);
    for (int step = 0; step < 7; ++step) {
      x += uniform(-1, 1), y += uniform(-1, 1), heading += uniform(-0.8, 0.8);
      const Eigen::Quaterniond q = Eigen::AngleAxisd(heading, Eigen::Vector3d::UnitZ()) *
                                   Eigen::AngleAxisd(uniform(-0.05, 0.05), Eigen::Vector3d::UnitX());
      View view{uniform.cloud(15),
                {camera_mount(0, 0.2, 1.5, uniform(-0.5, 0.5), uniform(-0.5, 0)), 492.8 / 4, 0.57},
                {x, y, uniform(-0.05, 0.05), q.w(), q.x(), q.y(), q.z()},
                std::vector<int16_t>(static_cast<size_t>(shape.cells * shape.cells), 77)};
      grid.fill(view.points, view.viewpoint, {view.cells.data(), shape.cells, shape.cells});
      std::vector<int16_t> cells = view.cells;
      window.keep(grid, view.points, view.viewpoint, view.robot_in_map, {cells.data(), shape.cells, shape.cells});
      window.merge_older({cells.data(), shape.cells, shape.cells});
      kept.push_back(std::move(view));
      if (kept.size() > size) kept.erase(kept.begin());
      CHECK(cells == merged_reference(kept, p, shape));
      for (size_t i = 0; i < cells.size(); ++i) {
        remembered += cells[i] == kOccupied && kept.back().cells[i] != kOccupied;
        opened += cells[i] == kFree && kept.back().cells[i] == kUnknown;
        lost += cells[i] < kept.back().cells[i];  // what the newest view knows
      }
    }
  }
  CHECK(lost == 0);
  CHECK(remembered >= takt::test::at_scale(1000));
  CHECK(opened >= takt::test::at_scale(1000));
}
