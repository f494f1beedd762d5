// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "nodes/cloud/outlier_filter.hpp"
#include "nodes/mapping_3d/evaluate.hpp"
#include "nodes/mapping_3d/obstacle_grid.hpp"
#include "rt/msg/point.hpp"

namespace takt::mapping_3d {
namespace {

// An obstacle is visible in a cell that so many rays meet it in, and so many of those that a face of it would get.
constexpr size_t kRays = 10;
constexpr double kShareOfFace = 0.25;

/// The grid of one look, as the node makes it.
class Gridded {
 public:
  explicit Gridded(const ObstacleParameters& p) : p_(p), grid_(p) {
    cells_.resize(static_cast<size_t>(grid_.shape().cells) * static_cast<size_t>(grid_.shape().cells));
  }

  void fill(const Look& look, const WorldCamera& camera) {
    cloud::OutlierFilter filter(look.points.size());
    std::vector<uint8_t> keep(look.points.size());
    std::vector<Point> points;
    filter.filter(look.points, {0.20, cloud::scaled_n_min(100, look.points.size())}, keep);
    for (size_t i = 0; i < keep.size(); ++i)
      if (keep[i] != 0) points.push_back(look.points[i]);
    grid_.fill(points,
               {look.camera_in_world, camera.focal_px / camera.step_px,
                std::atan(camera.width / 2.0 * camera.step_px / camera.focal_px)},
               view());
  }
  GridShape shape() const { return grid_.shape(); }
  const ObstacleParameters& parameters() const { return p_; }
  ImageView<int16_t> view() { return {cells_.data(), grid_.shape().cells, grid_.shape().cells}; }
  double middle_m(int cell) const { return grid_.shape().origin_m + (cell + 0.5) * p_.voxel_m; }
  /// Kinds of the cells whose middles lie there.
  struct Counts {
    double occupied = 0, free = 0, all = 0;
    double occupied_pct() const { return all > 0 ? 100 * occupied / all : 0; }
    double free_pct() const { return all > 0 ? 100 * free / all : 0; }
  };
  Counts within(double low_x, double high_x, double low_y, double high_y) {
    Counts counts;
    for (int row = 0; row < shape().cells; ++row)
      for (int column = 0; column < shape().cells; ++column) {
        const double x = middle_m(column), y = middle_m(row);
        if (x < low_x || x > high_x || y < low_y || y > high_y) continue;
        counts.all += 1;
        counts.occupied += view().at(column, row) == kOccupied;
        counts.free += view().at(column, row) == kFree;
      }
    return counts;
  }

 private:
  ObstacleParameters p_;
  ObstacleGrid grid_;
  std::vector<int16_t> cells_;
};

/// Whether anything between floor and robot height stands in the square around (x, y).
bool holds_obstacle(const World& world, double x, double y, const ObstacleParameters& p) {
  const double half = p.voxel_m / 2;
  for (const Box& box : world.boxes)
    if (box.high.z() > p.z_floor_m && box.low.z() < p.robot_height_m && box.low.x() < x + half &&
        box.high.x() > x - half && box.low.y() < y + half && box.high.y() > y - half)
      return true;
  return std::any_of(world.people.begin(), world.people.end(), [&](const Capsule& c) {
    const double dx = std::max(0.0, std::abs(c.from.x() - x) - half),
                 dy = std::max(0.0, std::abs(c.from.y() - y) - half);
    return std::hypot(dx, dy) < c.radius && c.to.z() + c.radius > p.z_floor_m &&
           c.from.z() - c.radius < p.robot_height_m;
  });
}

/// How many exact rays meet an obstacle in each cell, within range.
std::vector<size_t> rays_in_cells(const Look& look, const WorldCamera& camera, const ObstacleParameters& p,
                                  const GridShape& shape) {
  std::vector<size_t> rays(static_cast<size_t>(shape.cells) * static_cast<size_t>(shape.cells));
  const Affine m = to_affine(look.camera_in_world);
  const double focal = camera.focal_px / camera.step_px;
  for (size_t i = 0; i < look.depth_m.size(); ++i) {
    const double z = look.depth_m[i];
    const double u = static_cast<double>(i % static_cast<size_t>(camera.width)) - (camera.width - 1) / 2.0,
                 v = static_cast<double>(i / static_cast<size_t>(camera.width)) - (camera.height - 1) / 2.0;
    const Position at = transformed(m, u / focal * z, v / focal * z, z);
    int column = 0, row = 0;
    if (!(z > 0) || at.z_m < p.z_floor_m || at.z_m >= p.robot_height_m || std::hypot(at.x_m, at.y_m) > p.range_max_m ||
        !shape.cell_of(at.x_m, at.y_m, column, row))
      continue;
    ++rays[static_cast<size_t>(row) * static_cast<size_t>(shape.cells) + static_cast<size_t>(column)];
  }
  return rays;
}

void judge(const World& world, const Look& look, const WorldCamera& camera, Gridded& grid, ObstacleFigures& figures) {
  const GridShape shape = grid.shape();
  const ObstacleParameters& p = grid.parameters();
  const std::vector<size_t> rays = rays_in_cells(look, camera, p, shape);
  for (int row = 0; row < shape.cells; ++row)
    for (int column = 0; column < shape.cells; ++column) {
      const double x = grid.middle_m(column), y = grid.middle_m(row);
      const bool occupied = grid.view().at(column, row) == kOccupied, truth = holds_obstacle(world, x, y, p);
      const size_t cell = static_cast<size_t>(row) * static_cast<size_t>(shape.cells) + static_cast<size_t>(column);
      if (occupied) {
        bool beside = false;
        for (int i = 0; i < 9; ++i)
          beside |= holds_obstacle(world, x + (i % 3 - 1) * p.voxel_m, y + (i / 3 - 1) * p.voxel_m, p);
        ++figures.claimed;
        figures.right += truth;
        figures.near += beside;
      }
      const double edge_px = p.voxel_m * camera.focal_px / camera.step_px / std::hypot(x, y);
      if (truth && static_cast<double>(rays[cell]) >= std::max<double>(kRays, kShareOfFace * edge_px * edge_px)) {
        ++figures.visible;
        figures.found += occupied;
      }
    }
}

World scene_of(const std::string& kind, Lot& lot) {
  World world;
  const double x = lot.in(-0.8, 0.8), y = lot.in(2.2, 4);
  const auto box = [&](double half_x, double half_y, double from, double to) {
    world.boxes.push_back({{x - half_x, y - half_y, from}, {x + half_x, y + half_y, to}, {80, 80, 160}});
  };
  if (kind == "tables") add_table(world, x, y, lot.in(0.4, 0.8), lot.in(0.3, 0.5));
  if (kind == "overhangs") box(lot.in(0.5, 1), 0.1, 1.45, 1.7);
  if (kind == "people") add_person(world, x, y), add_person(world, -x, y + 0.7);
  if (kind == "boxes") box(lot.in(0.1, 0.4), lot.in(0.1, 0.4), 0, lot.in(0.2, 1.2));
  if (kind == "too high") box(lot.in(0.5, 1), 0.1, 2.0, 2.2);
  if (kind == "nothing") world.boxes.clear();
  return world;
}

}  // namespace

std::vector<ObstacleFigures> evaluate_obstacles(size_t runs, uint64_t seed) {
  std::vector<ObstacleFigures> all;
  const WorldCamera camera;
  for (const char* kind : {"tables", "overhangs", "people", "boxes", "too high", "nothing"}) {
    ObstacleFigures figures;
    figures.scene = kind;
    Gridded grid{ObstacleParameters{}};
    for (size_t run = 0; run < runs; ++run) {
      Lot lot(seed, run);
      const World world = scene_of(kind, lot);
      const Look seen = look(world, camera, robot_at(0, 0, 0), lot);
      grid.fill(seen, camera);
      judge(world, seen, camera, grid, figures);
    }
    all.push_back(figures);
  }
  return all;
}

EdgeFigures evaluate_edges(size_t runs, uint64_t seed) {
  constexpr double kCurb_m = 0.10, kRamp = 0.0875;  // tangent of 5 degrees
  constexpr double kHalf_m = 0.8, kFirst_m = 2.0, kLast_m = 5.4;
  ObstacleParameters flat;
  flat.slope = 0;
  const WorldCamera camera;
  Gridded grid{ObstacleParameters{}}, flat_grid{flat};
  EdgeFigures out;
  double columns = 0, closed = 0, before = 0, ramp = 0, free = 0, on_flat = 0;
  for (size_t run = 0; run < runs; ++run) {
    Lot lot(seed, run);
    const double edge_m = lot.in(2.5, 3.5);
    World world;
    world.boxes.push_back({{-4, edge_m, 0}, {4, edge_m + 6, kCurb_m}, {120, 120, 120}});
    grid.fill(look(world, camera, robot_at(0, 0, 0), lot), camera);
    for (double x = -kHalf_m; x < kHalf_m; x += 0.2) {
      columns += 1;
      closed += grid.within(x, x + 0.2, edge_m - 0.2, edge_m + 0.4).occupied > 0;
    }
    before += grid.within(-kHalf_m, kHalf_m, kFirst_m, edge_m - 0.3).occupied_pct();
    World rising;
    rising.ramp_from_m = edge_m;
    rising.ramp_slope = kRamp;
    const Look seen = look(rising, camera, robot_at(0, 0, 0), lot);
    grid.fill(seen, camera);
    flat_grid.fill(seen, camera);
    const auto cells = grid.within(-kHalf_m, kHalf_m, kFirst_m, kLast_m);
    ramp += cells.occupied_pct();
    free += cells.free_pct();
    on_flat += flat_grid.within(-kHalf_m, kHalf_m, kFirst_m, kLast_m).occupied_pct();
  }
  const auto n = static_cast<double>(runs);
  out.curb_rows_blocked_pct = 100 * closed / columns;
  out.before_curb_blocked_pct = before / n;
  out.ramp_blocked_pct = ramp / n;
  out.ramp_free_pct = free / n;
  out.flat_ramp_blocked_pct = on_flat / n;
  return out;
}

}  // namespace takt::mapping_3d
