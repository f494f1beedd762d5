// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "rt/memory/memory_use.hpp"
#include "rt/msg/laser_scan.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/msg/point_cloud.hpp"
#include "rt/sched/port_access.hpp"
#include "rt/testing.hpp"

namespace takt {
void register_laser_cloud(NodeTypes& types);
}

using namespace takt;

namespace {

std::unique_ptr<Node> make_node() {
  NodeTypes types;
  register_laser_cloud(types);
  return types.find("laser_cloud")->make();
}

/// Three beams: to the right, ahead, to the left.
void sweep(test::Box<LaserScan>& scan, float right, float ahead, float left) {
  scan->first_angle_rad = -std::numbers::pi / 2;
  scan->step_rad = std::numbers::pi / 2;
  scan->sensor_in_robot = {0, 0.5, 0.25, 1, 0, 0, 0};
  scan->range_m.resize(0);
  for (const float range : {right, ahead, left}) scan->range_m.push_back(range);
}

}  // namespace

TEST_CASE("laser_cloud: the last sweeps from where the robot was, in the scanner's frame at the newest with a pose") {
  const auto node = make_node();
  test::set(*node, "sweeps", int64_t{2});
  InputPort &scans = test::input(*node, "scan"), &odometry = test::input(*node, "odometry");
  PortAccess::connect(scans, {0, 0, 1, 3});
  PortAccess::connect(odometry, {});
  test::set_up(*node);
  test::BoxWriter<PointCloud> out(*node->outputs()[0]);
  test::Box<LaserScan> first({0, 0, 1, 3}), second({0, 0, 1, 3}), third({0, 0, 1, 3}), early({0, 0, 1, 3});
  sweep(first, 9, 9, 9);      // one too many
  sweep(second, 1, 2, 0);     // nothing to the left
  sweep(third, 1, 1.5f, 20);  // too far to the left
  sweep(early, 1, 1, 1);      // no pose yet
  test::latch(scans, first, 50, 1, 0);
  test::latch(scans, second, 100, 2, 1);
  test::latch(scans, third, 200, 3, 2);
  test::latch(scans, early, 300, 4, 3);
  CHECK_FALSE(test::run(*node));  // no pose at all
  test::Box<Odometry> then, now;  // driving along the odometry frame's x: 0.5 m on, turned left by 90 degrees
  now->x_m = 0.5;
  now->theta_rad = std::numbers::pi / 2;
  test::latch(odometry, then, 100, 1, 0);
  test::latch(odometry, now, 200, 2, 1);
  const uint64_t before = thread_memory_use().allocations;
  REQUIRE(test::run(*node));
  if (counting_allocations()) CHECK(thread_memory_use().allocations == before);
  CHECK(out.stamp_ns() == 200);
  const PointCloud& cloud = out.message();
  CHECK(cloud.sensor_in_robot.z == 0.25);
  CHECK(cloud.camera.focal_px == 0);
  REQUIRE(cloud.points.size == 4);
  const auto is = [&](uint32_t i, double x, double y) {
    CHECK(cloud.points[i].x == doctest::Approx(x));
    CHECK(cloud.points[i].y == doctest::Approx(y));
  };
  // In the odometry frame the scanner was at (0.5, 0) looking along x, and is at (0.5, 0.5) looking along y.
  is(0, 0, -1.5);  // from (0.5, -1)
  is(1, 2, -0.5);  // from (2.5, 0)
  is(2, 1, 0);
  is(3, 0, 1.5);
  out.clear();
  CHECK_FALSE(test::run(*node));  // nothing new
}

TEST_CASE("laser_cloud: without odometry the robot stands still") {
  const auto node = make_node();
  PortAccess::connect(test::input(*node, "scan"), {0, 0, 1, 3});
  test::set_up(*node);
  test::BoxWriter<PointCloud> out(*node->outputs()[0]);
  test::Box<LaserScan> scan({0, 0, 1, 3});
  sweep(scan, 1, 2, 3);
  test::latch(test::input(*node, "scan"), scan, 100, 1);
  REQUIRE(test::run(*node));
  REQUIRE(out.message().points.size == 3);
  CHECK(out.message().points[2].x == doctest::Approx(-3));
}
