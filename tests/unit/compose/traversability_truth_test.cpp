// SPDX-License-Identifier: Apache-2.0
// What the tilted scanner says one can drive on, during a drive through the lab, against the world's ground truth.
#include <doctest/doctest.h>

#include <cmath>
#include <map>

#include "rt/msg/grid.hpp"
#include "tests/unit/compose/drive.hpp"

using namespace takt;

namespace {

using Cell = std::pair<int, int>;  ///< column and row of the map frame

struct SeenFloor {
  double cell_m = 0;
  std::map<Cell, int16_t> floor, fused;  ///< what was last known of each cell
};

class FloorProbe final : public Node {
 public:
  SeenFloor seen;

  void setup(Setup&) override {}
  void run(Job&) override {
    keep(floor_, seen.floor);
    keep(fused_, seen.fused);
  }

 private:
  void keep(const Input<Grid>& port, std::map<Cell, int16_t>& cells) {
    const Grid* grid = port.newest();
    if (!grid || !port.is_new()) return;
    seen.cell_m = grid->cell_m;
    const auto column = static_cast<int>(std::lround((grid->grid_in_map.x + grid->origin_x_m) / grid->cell_m)),
               row = static_cast<int>(std::lround((grid->grid_in_map.y + grid->origin_y_m) / grid->cell_m));
    for (int y = 0; y < grid->height; ++y)
      for (int x = 0; x < grid->width; ++x)
        if (const int16_t value = grid->view().at(x, y); value >= 0) cells[{column + x, row + y}] = value;
  }
  Input<Grid> floor_{this, "floor", ""};
  Input<Grid> fused_{this, "fused", ""};
};

constexpr test::DriveGraph kTraversabilityGraph{
    .devices = R"(
  front_laser: {kind: laser_scanner, model: lms200, rate: 15, mount: {x: 0.0m, y: 0.30m, z: 0.25m}}
  floor_laser: {kind: laser_scanner, model: lms400, rate: 15, mount: {x: 0.0m, y: 0.25m, z: 1.0m, pitch: -34deg},
                beams: 281, fov: 70deg, range: 3m, noise: 4mm}
  base: {kind: mobile_base, rate: 15}
)",
    .nodes = R"(
    scan_matching:
      type: scan_matching
      in: {scan: {from: front_laser.scan, depth: 4}, odometry: {from: base.odometry, depth: 16}}
    robot_pose:
      type: robot_pose
      in: {odometry: {from: base.odometry, depth: 16}, scan_pose: {from: scan_matching.pose, depth: 16}}
    traversability:
      type: traversability
      in:
        scan: {from: floor_laser.scan, depth: 4}
        odometry: {from: robot_pose.odometry, depth: 16}
        grid: scan_matching.map
    probe: {type: probe, in: {floor: traversability.traversability, fused: traversability.fused}}
)",
    .schedule = R"(
  front_laser: {rate: 15, budget: 1ms}
  floor_laser: {rate: 15, budget: 1ms}
  base: {rate: 15, budget: 1ms}
  robot_pose: {rate: 15, offset: 10ms, budget: 1ms, criticality: high}
  traversability: {rate: 15, offset: 20ms, budget: 1ms}
  scan_matching: {rate: 5, offset: 30ms, budget: 5ms}
  probe: {rate: 15, offset: 50ms, budget: 1ms}
)",
};

/// Cells called blocked and free, and how many of them with reason.
struct Judged {
  size_t blocked = 0, blocked_rightly = 0, free = 0, free_rightly = 0;
};

/// Blocked rightly: something stands within two cells of it, as the rules say. Free rightly: nothing stands on its
/// middle.
Judged judge(const std::map<Cell, int16_t>& cells, double cell_m, const sim::Simulation& world) {
  const sim::RobotState start = world.robot(world.epoch_ns());
  const double c = std::cos(start.theta_rad), s = std::sin(start.theta_rad);
  Judged out;
  for (const auto& [cell, value] : cells) {
    const double x = (cell.first + 0.5) * cell_m, y = (cell.second + 0.5) * cell_m;
    const sim::Vec2 at(start.x_m + c * x - s * y, start.y_m + s * x + c * y);
    const bool blocked = value > 500;
    ++(blocked ? out.blocked : out.free);
    if (blocked) out.blocked_rightly += collides(world.world(), at, 2.5 * cell_m);
    else out.free_rightly += !collides(world.world(), at, 1e-6);
  }
  return out;
}

double pct(size_t part, size_t of) { return of == 0 ? 0 : 100.0 * static_cast<double>(part) / static_cast<double>(of); }

}  // namespace

TEST_CASE("what a tilted scanner says of the floor on a drive through the lab agrees with the world") {
  test::Drive<FloorProbe> drive(kTraversabilityGraph, 75'000'000'000);
  const SeenFloor& seen = drive.probe().seen;
  const Judged floor = judge(seen.floor, seen.cell_m, drive.world()),
               fused = judge(seen.fused, seen.cell_m, drive.world());
  for (const Judged& j : {floor, fused}) {
    MESSAGE(j.blocked << " cells blocked, " << pct(j.blocked_rightly, j.blocked) << " % rightly; " << j.free
                      << " free, " << pct(j.free_rightly, j.free) << " % rightly");
    CHECK(pct(j.blocked_rightly, j.blocked) > 95);
    CHECK(pct(j.free_rightly, j.free) > 98);
  }
  CHECK(floor.free > 1500);
  CHECK(floor.blocked > 30);
  CHECK(fused.free > 3 * floor.free / 2);
  CHECK(fused.blocked > 5 * floor.blocked);
}
