// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <memory>

#include "nodes/mapping_3d/pose.hpp"
#include "nodes/scan_matching/drive.hpp"
#include "rt/memory/memory_use.hpp"
#include "rt/msg/grid.hpp"
#include "rt/msg/laser_scan.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/msg/pose.hpp"
#include "rt/sched/port_access.hpp"
#include "rt/testing.hpp"

namespace takt {
void register_scan_matching(NodeTypes& types);
}

using namespace takt;
using namespace takt::scan_matching;

namespace {

constexpr int64_t kStep_ns = 200'000'000;

/// The node in the furnished room, with all ports connected.
struct Fixture {
  Drive drive = make_drive(furnished_room(1), rounds(40), {}, 1);
  std::unique_ptr<Node> node;
  InputPort *scan_port, *odometry_port;
  std::unique_ptr<test::BoxWriter<Pose>> pose;
  std::unique_ptr<test::BoxWriter<Odometry>> moved;
  std::unique_ptr<test::BoxWriter<Grid>> map;
  test::Box<LaserScan> scan{{0, 0, 1, 181}};
  test::Box<Odometry> before, now;
  uint64_t sequence = 0;

  explicit Fixture(bool with_odometry = true) {
    NodeTypes types;
    register_scan_matching(types);
    node = types.find("scan_matching")->make();
    scan_port = &test::input(*node, "scan");
    odometry_port = &test::input(*node, "odometry");
    PortAccess::connect(*scan_port, {0, 0, 1, 181});
    if (with_odometry) PortAccess::connect(*odometry_port, {});
    test::set_up(*node);
    pose = std::make_unique<test::BoxWriter<Pose>>(*node->outputs()[0]);
    moved = std::make_unique<test::BoxWriter<Odometry>>(*node->outputs()[1]);
    map = std::make_unique<test::BoxWriter<Grid>>(*node->outputs()[2]);
  }
  static int64_t stamp(size_t i) { return static_cast<int64_t>(i + 1) * kStep_ns; }
  void put(test::Box<Odometry>& box, size_t i) const {
    const PlanarPose& p = drive.scans[i].odometry;
    box->x_m = p.x_m;
    box->y_m = p.y_m;
    box->theta_rad = p.theta_rad + std::numbers::pi / 2;
  }
  /// Latches scan i, and the odometry at scans i - 1 and i.
  void latch(size_t i, bool odometry_too) {
    const Sweep sweep = drive.sweep(i);
    scan->first_angle_rad = sweep.first_angle_rad;
    scan->step_rad = sweep.step_rad;
    scan->max_range_m = 30;
    scan->range_m.resize(181);
    std::copy(sweep.range_m.begin(), sweep.range_m.end(), scan->range_m.data());
    test::latch(*scan_port, scan, stamp(i), ++sequence);
    if (!odometry_too) return;
    put(before, i > 0 ? i - 1 : 0);
    put(now, i);
    test::latch(*odometry_port, before, stamp(i > 0 ? i - 1 : 0), sequence, 0);
    test::latch(*odometry_port, now, stamp(i), sequence + 1, 1);
  }
  bool run() {
    pose->clear();
    moved->clear();
    map->clear();
    return test::run(*node);
  }
};

}  // namespace

TEST_CASE("scan_matching: pose, odometry and map of each scan, in the frame where the odometry began") {
  Fixture f;
  CHECK_FALSE(f.run());  // nothing latched
  for (size_t i = 0; i < f.drive.scans.size(); ++i) {
    CAPTURE(i);
    f.latch(i, true);
    const uint64_t allocations = thread_memory_use().allocations;
    REQUIRE(f.run());
    if (counting_allocations()) CHECK(thread_memory_use().allocations == allocations);
    REQUIRE(f.pose->sent());
    REQUIRE(f.moved->sent());
    REQUIRE(f.map->sent());
    CHECK(f.pose->stamp_ns() == Fixture::stamp(i));
    const PlanarPose truth =
        compose(f.drive.scans[0].odometry, between(f.drive.scans[0].truth, f.drive.scans[i].truth));
    const PlanarPose found = planar(f.pose->message().transform);
    CHECK(std::hypot(found.x_m - truth.x_m, found.y_m - truth.y_m) < 0.03);
    const PlanarPose again = planar(mapping_3d::robot_in_odometry(f.moved->message()));
    CHECK(std::hypot(found.x_m - again.x_m, found.y_m - again.y_m) < 1e-9);
    CHECK(wrapped(found.theta_rad - again.theta_rad) == doctest::Approx(0));
    if (i > 0) CHECK(f.moved->message().speed_m_s == doctest::Approx(0.5).epsilon(0.1));  // 0.1 m in 0.2 s
    CHECK_FALSE(f.run());                                                                 // the same scan again
    CHECK_FALSE(f.pose->sent());
  }
  Grid& map = f.map->message();
  const PlanarPose robot = planar(f.pose->message().transform);
  const auto at = [&](double x, double y) {
    return map.view().at(static_cast<int>(std::floor((x - map.grid_in_map.x - map.origin_x_m) / map.cell_m)),
                         static_cast<int>(std::floor((y - map.grid_in_map.y - map.origin_y_m) / map.cell_m)));
  };
  CHECK(at(robot.x_m, robot.y_m) < 300);
  // Where the last scan ended there is something.
  const Sweep sweep = f.drive.sweep(f.drive.scans.size() - 1);
  size_t marked = 0;
  for (size_t i = 0; i < sweep.range_m.size(); ++i) {
    const double angle = robot.theta_rad + sweep.first_angle_rad + static_cast<double>(i) * sweep.step_rad;
    marked += at(robot.x_m - sweep.range_m[i] * std::sin(angle), robot.y_m + sweep.range_m[i] * std::cos(angle)) > 500;
  }
  CHECK(marked > 160);
}

TEST_CASE("scan_matching: a scan waits for its odometry, and goes without once that has fallen silent") {
  Fixture f;
  f.latch(0, true);
  CHECK(f.run());
  f.latch(1, false);  // the odometry ends at scan 0
  CHECK_FALSE(f.run());
  f.latch(1, true);
  CHECK(f.run());
  CHECK(f.pose->stamp_ns() == Fixture::stamp(1));
  f.latch(2, false);
  CHECK_FALSE(f.run());
  f.latch(3, false);
  CHECK_FALSE(f.run());
  f.latch(4, false);  // 0.6 s after the last odometry
  CHECK(f.run());
  CHECK(f.pose->stamp_ns() == Fixture::stamp(4));
}

TEST_CASE("scan_matching without odometry: begins at the origin, and a scan of nothing gives nothing") {
  Fixture f(false);
  f.latch(0, false);
  REQUIRE(f.run());
  CHECK(f.pose->message().transform.x == 0);
  f.latch(1, false);
  REQUIRE(f.run());
  const PlanarPose truth = f.drive.moved_truly(1), found = planar(f.pose->message().transform);
  CHECK(std::hypot(found.x_m - truth.x_m, found.y_m - truth.y_m) < 0.02);
  std::fill(f.drive.range_m.begin(), f.drive.range_m.end(), 0.0f);
  f.latch(2, false);
  CHECK_FALSE(f.run());
  CHECK_FALSE(f.pose->sent());
  CHECK_FALSE(f.map->sent());
}

TEST_CASE("scan_matching refuses a map of less than two cells") {
  NodeTypes types;
  register_scan_matching(types);
  const auto node = types.find("scan_matching")->make();
  test::set(*node, "map_cell", 1.0);
  test::set(*node, "map_window", 1.5);
  PortAccess::connect(test::input(*node, "scan"), {0, 0, 1, 181});
  CHECK_THROWS_AS(test::set_up(*node), SetupError);
}

TEST_CASE("scan_matching: one that takes another's place goes on from its pose and in its map") {
  constexpr size_t kTaken = 9;
  Fixture first, next, anew;
  const auto known = [](Grid& map) {
    const auto cells = map.cells.items();
    return std::count_if(cells.begin(), cells.end(), [](int16_t cell) { return cell != Grid::unknown; });
  };
  for (size_t i = 0; i <= kTaken; ++i) {
    first.latch(i, true);
    REQUIRE(first.run());
  }
  PortAccess::hand_over(*next.node->outputs()[0], &first.pose->message());
  PortAccess::hand_over(*next.node->outputs()[2], &first.map->message());
  next.node->start(0);
  for (OutputPort* output : next.node->outputs()) PortAccess::hand_over(*output, nullptr);
  for (size_t i = kTaken; i <= kTaken + 1; ++i)
    for (Fixture* f : {&next, &anew}) {
      f->latch(i, true);
      REQUIRE(f->run());
    }
  first.latch(kTaken + 1, true);
  REQUIRE(first.run());
  const PlanarPose expected = planar(first.pose->message().transform), found = planar(next.pose->message().transform);
  CHECK(std::hypot(found.x_m - expected.x_m, found.y_m - expected.y_m) < 0.03);
  CHECK(std::abs(wrapped(found.theta_rad - expected.theta_rad)) < 0.02);
  CHECK(known(next.map->message()) >= known(first.map->message()) * 99 / 100);
  CHECK(known(anew.map->message()) < known(next.map->message()));  // what was handed over is more than two scans show
}
