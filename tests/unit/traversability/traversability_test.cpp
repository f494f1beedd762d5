// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <memory>

#include "nodes/traversability/height_map.hpp"
#include "rt/memory/memory_use.hpp"
#include "rt/msg/grid.hpp"
#include "rt/msg/laser_scan.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/sched/port_access.hpp"
#include "rt/testing.hpp"
#include "tests/unit/traversability/tilted_laser.hpp"

namespace takt {
void register_traversability(NodeTypes& types);
}

using namespace takt;
using namespace takt::traversability;
using mapping_3d::Position;
using test::Floor;
using test::TiltedLaser;

namespace {

/// The grid after a drive of 2.4 m along the y axis at 0.5 m/s and 15 Hz.
struct Driven {
  HeightMap map{{}};
  std::vector<int16_t> cells;

  explicit Driven(const Floor& floor) : cells(static_cast<size_t>(map.side()) * static_cast<size_t>(map.side())) {
    const TiltedLaser laser;
    std::mt19937_64 random(1);
    for (int i = 0; i < 72; ++i) {
      const double y_m = i / 30.0;
      const auto ranges = laser.look(floor, 0, y_m, random);
      const mapping_3d::Affine mount = mapping_3d::to_affine(laser.mount());
      std::vector<Position> points;
      for (uint32_t beam = 0; beam < laser.beams; ++beam) {
        if (!(ranges[beam] > 0)) continue;
        const double angle = laser.first_angle_rad() + beam * laser.step_rad();
        Position p = transformed(mount, -ranges[beam] * std::sin(angle), ranges[beam] * std::cos(angle), 0);
        p.y_m += y_m;
        points.push_back(p);
      }
      map.centre(0, y_m);
      map.add(points, i * 66'000'000LL);
    }
    map.judge(view());
  }
  ImageView<int16_t> view() { return {cells.data(), map.side(), map.side()}; }
  int at(double x_m, double y_m) {
    return view().at(static_cast<int>(std::floor((x_m - map.origin_x_m()) / map.cell_m())),
                     static_cast<int>(std::floor((y_m - map.origin_y_m()) / map.cell_m())));
  }
  /// Share of the known cells between two y, within 0.6 m of the axis, that are blocked.
  double blocked(double from_y_m, double to_y_m) {
    int known = 0, blocked = 0;
    for (double x = -0.525; x < 0.6; x += map.cell_m())
      for (double y = from_y_m; y < to_y_m; y += map.cell_m()) {
        known += at(x, y) != kUnknown;
        blocked += at(x, y) == kBlocked;
      }
    REQUIRE(known >= 16);
    return static_cast<double>(blocked) / known;
  }
  /// A cell of each column across the way is blocked between two y: nothing drives through.
  bool closed(double from_y_m, double to_y_m) {
    for (double x = -0.525; x < 0.6; x += map.cell_m()) {
      bool any = false;
      for (double y = from_y_m; y < to_y_m; y += map.cell_m()) any |= at(x, y) == kBlocked;
      if (!any) return false;
    }
    return true;
  }
};

double degrees(double d) { return std::tan(d * std::numbers::pi / 180); }

}  // namespace

TEST_CASE("level floor is free, a 5 degree ramp is free up and down, a 20 degree ramp is blocked") {
  CHECK(Driven([](double, double) { return 0.0; }).blocked(1.8, 3.6) == 0);
  for (const double slope : {5.0, -5.0}) {
    CAPTURE(slope);
    CHECK(Driven([&](double, double y) { return std::max(0.0, y - 2) * degrees(slope); }).blocked(1.8, 3.6) == 0);
  }
  CHECK(Driven([&](double, double y) { return std::max(0.0, y - 2) * degrees(20); }).blocked(2.2, 3.2) > 0.95);
}

TEST_CASE("a 10 cm curb is blocked, up and down, wherever its edge lies in a cell; beside it one can drive") {
  for (const double height : {0.1, -0.1})
    for (const double edge : {2.40, 2.43, 2.475, 2.52, 2.5499}) {
      CAPTURE(height);
      CAPTURE(edge);
      Driven driven([&](double, double y) { return y < edge ? 0 : height; });
      CHECK(driven.closed(edge - 0.3, edge + 0.4));
      CHECK(driven.blocked(1.8, edge - 0.3) == 0);
      CHECK(driven.blocked(edge + 0.5, 3.6) == 0);
    }
}

TEST_CASE("a 2 cm step does not block, a box does, what hangs above the robot does not") {
  CHECK(Driven([](double, double y) { return y < 2.4 ? 0 : 0.02; }).blocked(1.8, 3.6) == 0);
  Driven box([](double x, double y) { return std::abs(x) < 0.3 && y > 2.4 && y < 2.8 ? 0.4 : 0.0; });
  CHECK(box.at(0, 2.45) == kBlocked);
  CHECK(box.at(0.525, 2.25) == kFree);
  HeightMap map({});
  std::vector<Position> points;
  for (int i = 0; i < 20; ++i) points.push_back({0.01 * (i % 7), 0.013 * (i % 5), i % 2 == 0 ? 0.0 : 1.9});
  map.add(points, 0);
  CHECK(map.surface(map.side() / 2, map.side() / 2).range_m == 0);
}

TEST_CASE("few points are unknown; a cell that was not seen for long begins anew") {
  HeightMap map({});
  const int middle = map.side() / 2;
  const std::vector<Position> low(4, {0.05, 0.05, 0}), high(5, {0.05, 0.05, 0.3});
  map.add(low, 0);
  CHECK_FALSE(map.surface(middle, middle).known);
  map.add(low, 1'000'000'000);
  CHECK(map.surface(middle, middle).known);
  map.add(high, 5'900'000'000);  // 4.9 s after it was seen
  CHECK(map.surface(middle, middle).range_m == doctest::Approx(0.3));
  map.add(high, 11'000'000'000);
  CHECK(map.surface(middle, middle).range_m == 0);
  CHECK(map.surface(middle, middle).mean_m == doctest::Approx(0.3));
}

TEST_CASE(
    "traversability node: grids at the newest scan with a pose, fused with what else is known, nothing allocated") {
  NodeTypes types;
  register_traversability(types);
  const auto node = types.find("traversability")->make();
  const TiltedLaser laser;
  InputPort &scan_port = test::input(*node, "scan"), &odometry_port = test::input(*node, "odometry"),
            &grid_port = test::input(*node, "grid");
  PortAccess::connect(scan_port, {0, 0, 1, laser.beams});
  PortAccess::connect(odometry_port, {});
  PortAccess::connect(grid_port, {10, 10, 1, 0});
  test::set_up(*node);
  test::BoxWriter<Grid> driveable(*node->outputs()[0]), fused(*node->outputs()[1]);
  test::Box<LaserScan> scan({0, 0, 1, laser.beams});
  test::Box<Odometry> before, now;
  test::Box<Grid> known({10, 10, 1, 0});
  known->width = known->height = 10;
  known->cell_m = 0.2;
  known->grid_in_map = {0.5, 3, 0, 1, 0, 0, 0};
  REQUIRE(known->cells.resize(100));
  std::fill_n(known->cells.data(), 100, kBlocked);
  test::latch(grid_port, known, 0, 1);
  std::mt19937_64 random(1);
  CHECK_FALSE(test::run(*node));
  const auto at = [](Grid& grid, double x, double y) {
    return grid.view().at(static_cast<int>(std::floor((x - grid.grid_in_map.x - grid.origin_x_m) / grid.cell_m)),
                          static_cast<int>(std::floor((y - grid.grid_in_map.y - grid.origin_y_m) / grid.cell_m)));
  };
  for (int i = 1; i <= 72; ++i) {
    const auto ranges = laser.look([](double, double y) { return y < 2.4 ? 0.0 : 0.1; }, 0, i / 30.0, random);
    scan->first_angle_rad = laser.first_angle_rad();
    scan->step_rad = laser.step_rad();
    scan->sensor_in_robot = laser.mount();
    scan->range_m.resize(laser.beams);
    std::copy(ranges.begin(), ranges.end(), scan->range_m.data());
    before->y_m = (i - 1) / 30.0;
    now->y_m = i / 30.0;
    before->theta_rad = now->theta_rad = std::numbers::pi / 2;
    const int64_t stamp_ns = i * 66'000'000LL;
    const auto sequence = static_cast<uint64_t>(i);
    test::latch(scan_port, scan, stamp_ns, sequence);
    if (i == 1) CHECK_FALSE(test::run(*node));  // no pose yet
    test::latch(odometry_port, before, stamp_ns - 66'000'000, sequence, 0);
    test::latch(odometry_port, now, stamp_ns, sequence + 1, 1);
    driveable.clear();
    fused.clear();
    const uint64_t allocations = thread_memory_use().allocations;
    REQUIRE(test::run(*node));
    if (counting_allocations()) CHECK(thread_memory_use().allocations == allocations);
    CHECK(driveable.stamp_ns() == stamp_ns);
  }
  CHECK(at(driveable.message(), 0.01, 2.0) == kFree);
  CHECK((at(driveable.message(), 0.01, 2.39) == kBlocked || at(driveable.message(), 0.01, 2.41) == kBlocked));
  CHECK(at(driveable.message(), 0.01, 3.0) == kFree);
  CHECK(at(fused.message(), 0.01, 2.0) == kFree);
  CHECK(at(fused.message(), 0.6, 3.2) == kBlocked);
  CHECK_FALSE(test::run(*node));  // the same scan again
}
