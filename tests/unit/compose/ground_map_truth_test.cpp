// SPDX-License-Identifier: Apache-2.0
// The ground map of a drive through the lab against the world's ground truth.
#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <map>
#include <set>
#include <vector>

#include "rt/msg/ace/terrain.hpp"
#include "rt/msg/grid.hpp"
#include "tests/unit/compose/drive.hpp"

using namespace takt;

namespace {

constexpr double kCellM = 0.30, kRangeM = 8;  // defaults of ground_map

using Cell = std::pair<int, int>;  ///< column and row of the map frame

struct SeenGround {
  std::set<int64_t> stamps;    ///< of the images that were mapped
  std::set<int64_t> terrains;  ///< of those whose terrain was judged
  int32_t width = 0, height = 0;
  double cell_m = 0, corner_x_m = 0, corner_y_m = 0;  ///< of the last grid, in the map frame
  std::vector<int16_t> cells;

  /// Of the last grid; unknown outside of it.
  int16_t value(const Cell& cell) const {
    const int column = cell.first - static_cast<int>(std::lround(corner_x_m / kCellM)),
              row = cell.second - static_cast<int>(std::lround(corner_y_m / kCellM));
    if (column < 0 || row < 0 || column >= width || row >= height) return Grid::unknown;
    return cells[static_cast<size_t>(row * width + column)];
  }
  bool occupied_near(const Cell& cell, int reach) const {
    for (int dy = -reach; dy <= reach; ++dy)
      for (int dx = -reach; dx <= reach; ++dx)
        if (value({cell.first + dx, cell.second + dy}) > 500) return true;
    return false;
  }
};

class GridProbe final : public Node {
 public:
  SeenGround seen;

  void setup(Setup&) override {}
  void run(Job&) override {
    if (const Terrain* terrain = terrain_.newest(); terrain && terrain->kind <= terrain_kind::unknown)
      seen.terrains.insert(terrain_.stamp_ns());
    const Grid* grid = grid_.newest();
    if (!grid || !grid_.is_new()) return;
    seen.stamps.insert(grid_.stamp_ns());
    seen.width = grid->width, seen.height = grid->height;
    seen.cell_m = grid->cell_m;
    seen.corner_x_m = grid->origin_x_m + grid->grid_in_map.x;
    seen.corner_y_m = grid->origin_y_m + grid->grid_in_map.y;
    seen.cells.assign(grid->cells.items().begin(), grid->cells.items().end());
  }

 private:
  Input<Grid> grid_{this, "grid", ""};
  Input<Terrain> terrain_{this, "terrain", ""};
};

// The window is large enough to keep the whole lab.
constexpr test::DriveGraph kGroundMapGraph{
    .devices = R"(
  ground_camera: {kind: stereo_camera, rig: @/rigs/x2_wide.yaml, rate: 5}
  front_laser: {kind: laser_scanner, model: lms200, rate: 15, mount: {x: 0.0m, y: 0.30m, z: 0.25m, yaw: 0deg}}
  base: {kind: mobile_base, rate: 15}
)",
    .nodes = R"(
    ground_map:
      type: ground_map
      in:
        pair: {from: ground_camera.pair, depth: 4}
        scan: {from: front_laser.scan, depth: 4}
        odometry: {from: base.odometry, depth: 16}
      params: {window: 36m, terrain_maps: @/terrain.txt}
    probe: {type: probe, in: {grid: ground_map.grid, terrain: ground_map.terrain}}
)",
    .schedule = R"(
  ground_camera: {rate: 5, offset: 5ms, budget: 10ms}
  front_laser: {rate: 15, budget: 1ms}
  base: {rate: 15, budget: 1ms}
  ground_map: {rate: 5, offset: 46ms, budget: 6ms, criticality: high}
  probe: {rate: 5, offset: 90ms, budget: 1ms}
)",
};

/// What the camera saw of a cell: in how many images.
struct Sight {
  int as_floor = 0, as_border = 0;
};

/// Columns of one image in which a cell is floor before anything stands, and in which something first stands in it.
struct Columns {
  int floor = 0, border = 0, last_floor = -1;
};

/// The map frame of the odometry: the robot's place at the start, x along its heading.
Eigen::Isometry2d map_in_world(const sim::Simulation& world) {
  const sim::RobotState start = world.robot(world.epoch_ns());
  return Eigen::Translation2d(start.x_m, start.y_m) * Eigen::Rotation2Dd(start.theta_rad);
}

/// One image by the world's true depth: each column upwards until something stands (A-12), within
/// the range of ground_map.
std::map<Cell, Columns> look(const sim::Simulation& world, const StereoRig& rig, int64_t stamp_ns) {
  std::vector<float> depth(static_cast<size_t>(rig.width) * static_cast<size_t>(rig.height));
  world.true_depth(rig, stamp_ns, depth.data());
  const sim::CameraPose camera = world.camera_pose(rig, 0, stamp_ns);
  const sim::RobotState robot = world.robot(stamp_ns);
  const Eigen::Isometry2d to_map = map_in_world(world).inverse();
  std::map<Cell, Columns> cells;
  for (int u = 0; u < rig.width; ++u)
    for (int v = rig.height - 1; v >= 0; --v) {
      const double z = depth[static_cast<size_t>(v * rig.width + u)];
      const sim::Vec3 p = camera.position + camera.rotation * sim::Vec3(z * (u - rig.cu_px) / rig.focal_px,
                                                                        z * (v - rig.cv_px) / rig.focal_px, z);
      if (z <= 0 || std::hypot(p.x() - robot.x_m, p.y() - robot.y_m) > kRangeM) break;
      const Eigen::Vector2d at = to_map * Eigen::Vector2d(p.x(), p.y()) / kCellM;
      Columns& cell = cells[{static_cast<int>(std::floor(at.x())), static_cast<int>(std::floor(at.y()))}];
      const bool stands = p.z() > 0.01;
      if (stands) ++cell.border;
      if (stands) break;
      cell.floor += cell.last_floor != u;
      cell.last_floor = u;
    }
  return cells;
}

struct Shares {
  int blocked = 0, marked = 0, marked_near = 0;  ///< near: the cell or one of its eight neighbours
  int free = 0, called_free = 0, called_occupied = 0;
};

Shares compare(const std::map<Cell, Sight>& sights, const SeenGround& seen, const sim::Simulation& world) {
  constexpr int kImages = 3;  // a cell seen in fewer does not count
  const Eigen::Isometry2d to_world = map_in_world(world);
  Shares s;
  for (const auto& [cell, sight] : sights) {
    const Eigen::Vector2d centre = to_world * (kCellM * Eigen::Vector2d(cell.first + 0.5, cell.second + 0.5));
    const int16_t v = seen.value(cell);
    if (sight.as_border >= kImages) {
      ++s.blocked;
      s.marked += v > 500;
      s.marked_near += seen.occupied_near(cell, 1);
    } else if (sight.as_floor >= kImages && !sim::collides(world.world(), centre, kCellM * std::sqrt(0.5))) {
      ++s.free;
      s.called_free += v >= 0 && v < 500;
      s.called_occupied += v > 500;
    }
  }
  return s;
}

double percent(int part, int whole) { return 100.0 * part / whole; }

}  // namespace

// Counted are cells of 0.3 m in the last grid that at least 3 of the mapped images saw, each in at least 5 columns.
// Truly blocked: something stands in the cell where the floor of those columns ends. Truly free: seen as floor, and
// nothing touches the circle around the cell. A cell that is still unknown counts against both. A border is counted
// with the neighbouring cells too, because a face may stand a few centimetres from the next cell and the odometry
// drifts by more than that. After 30 s its drift begins to be what is measured.
TEST_CASE("the ground map of a drive through the lab agrees with the world") {
  test::Drive<GridProbe> drive(kGroundMapGraph, 30'000'000'000);
  const SeenGround& seen = drive.probe().seen;
  const sim::Simulation& world = drive.world();
  const StereoRig rig = test::rig_of("ground_camera", "x2_wide.yaml");
  REQUIRE(seen.stamps.size() > 145);
  REQUIRE(seen.cell_m == doctest::Approx(kCellM));
  CHECK(seen.terrains == seen.stamps);

  std::map<Cell, Sight> sights;
  for (const int64_t stamp_ns : seen.stamps)
    for (const auto& [cell, columns] : look(world, rig, stamp_ns)) {
      sights[cell].as_floor += columns.floor >= 5;
      sights[cell].as_border += columns.border >= 5;
    }
  const Shares s = compare(sights, seen, world);
  MESSAGE("blocked cells: " << s.blocked << ", marked " << percent(s.marked, s.blocked) << " %, marked or next to one "
                            << percent(s.marked_near, s.blocked) << " %");
  MESSAGE("free cells: " << s.free << ", called free " << percent(s.called_free, s.free) << " %, called occupied "
                         << percent(s.called_occupied, s.free) << " %");
  REQUIRE(s.blocked > 100);
  REQUIRE(s.free > 400);
  CHECK(percent(s.marked, s.blocked) > 50);
  CHECK(percent(s.marked_near, s.blocked) > 95);
  CHECK(percent(s.called_free, s.free) > 90);
  CHECK(percent(s.called_occupied, s.free) < 5);
}
