// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>

#include "nodes/mapping_3d/pose.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/grid.hpp"
#include "rt/msg/motion.hpp"
#include "rt/msg/point_cloud.hpp"
#include "rt/sched/port_access.hpp"
#include "rt/testing.hpp"
#include "rt/transform/pose_math.hpp"

namespace takt {
void register_mapping_3d(NodeTypes& types);
}

using namespace takt;

TEST_CASE("mapping_3d: one grid per cloud, with the cloud's stamp and the robot's pose at that stamp") {
  NodeTypes types;
  register_mapping_3d(types);
  const auto node = types.find("mapping_3d")->make();
  auto& cloud_port = test::input(*node, "cloud");
  auto& motion_port = test::input(*node, "motion");
  PortAccess::connect(cloud_port, {0, 0, 1, 1000});
  PortAccess::connect(motion_port, {});
  test::set_up(*node);
  test::BoxWriter<Grid> out(*node->outputs()[0]);

  CHECK_FALSE(test::run(*node));  // nothing latched

  test::Box<PointCloud> cloud({0, 0, 1, 1000});
  cloud->camera = {492.8, 319.5, 239.5, 0.24};
  cloud->sensor_in_robot = mapping_3d::camera_mount(0, 0.3, 1.5, 0, 0);
  for (int i = 0; i < 900; ++i) cloud->points.push_back({0.1f, 0.5f, 2.8f});  // robot frame (0.1, 3.1, 1.0)
  test::latch(cloud_port, cloud, 150, 1);
  test::Box<Motion> a, b;
  b->pose.z = 1;  // one metre ahead
  test::latch(motion_port, a, 100, 1, 0);
  test::latch(motion_port, b, 200, 2, 1);
  CHECK(test::run(*node));
  REQUIRE(out.sent());
  CHECK(out.stamp_ns() == 150);
  Grid& grid = out.message();
  CHECK(grid.grid_in_map.y == doctest::Approx(0.5));
  CHECK(grid.grid_in_map.qw == doctest::Approx(1));
  const auto at = [&](double x, double y) {
    return grid.view().at(static_cast<int>((x - grid.origin_x_m) / grid.cell_m),
                          static_cast<int>((y - grid.origin_y_m) / grid.cell_m));
  };
  CHECK(at(0.1, 3.1) == 1000);
  CHECK(at(0.1, 2.1) == 0);
  CHECK(at(0.1, -2.1) == Grid::unknown);

  out.clear();
  CHECK_FALSE(test::run(*node));  // the same cloud again
  CHECK_FALSE(out.sent());
}

TEST_CASE("mapping_3d: the newest cloud whose pose is known; a robot that turns on the spot stays on it (E-25)") {
  NodeTypes types;
  register_mapping_3d(types);
  const auto node = types.find("mapping_3d")->make();
  auto& cloud_port = test::input(*node, "cloud");
  auto& motion_port = test::input(*node, "motion");
  PortAccess::connect(cloud_port, {0, 0, 1, 10});
  PortAccess::connect(motion_port, {});
  test::set_up(*node);
  test::BoxWriter<Grid> out(*node->outputs()[0]);

  // The camera sits 0.5 m before the axis that the robot turns about, so it moves on a circle.
  const UncertainPose mount{mapping_3d::camera_mount(0, 0.5, 1.6, 0, 0), {}},
      turn{{0, 0, 0, std::cos(0.1), 0, 0, std::sin(0.1)}, {}};
  test::Box<PointCloud> old({0, 0, 1, 10}), newer({0, 0, 1, 10});
  for (auto* cloud : {&old, &newer}) {
    (*cloud)->camera = {492.8, 319.5, 239.5, 0.24};
    (*cloud)->sensor_in_robot = mount.transform;
  }
  test::Box<Motion> motion;
  motion->pose = compose(compose(inverse(mount), turn), mount).transform;
  CHECK(std::hypot(motion->pose.x, motion->pose.z) > 0.05);
  test::latch(cloud_port, old, 200, 1, 0);
  test::latch(cloud_port, newer, 300, 2, 1);
  CHECK_FALSE(test::run(*node));  // no pose at all
  test::latch(motion_port, motion, 200, 1);
  CHECK(test::run(*node));
  REQUIRE(out.sent());
  CHECK(out.stamp_ns() == 200);  // nothing tells yet where the newer one was seen from
  const Transform robot = out.message().grid_in_map;
  CHECK(std::hypot(robot.x, robot.y) < 1e-12);
  CHECK(std::abs(robot.qz) == doctest::Approx(std::sin(0.1)));

  // Where the newer one is all there is, its pose is predicted: as far again as from the pose before.
  out.clear();
  test::Box<Motion> before;
  test::latch(cloud_port, newer, 300, 2, 0);
  test::latch(motion_port, before, 100, 1, 0);
  test::latch(motion_port, motion, 200, 2, 1);
  CHECK(test::run(*node));
  REQUIRE(out.sent());
  CHECK(out.stamp_ns() == 300);
  CHECK(std::abs(out.message().grid_in_map.qz) == doctest::Approx(std::sin(0.2)).epsilon(0.01));
}

TEST_CASE("mapping_3d: points without company are no obstacle, unless outlier_radius is 0") {
  for (const double radius : {0.2, 0.0}) {
    NodeTypes types;
    register_mapping_3d(types);
    const auto node = types.find("mapping_3d")->make();
    test::set(*node, "outlier_radius", radius);
    test::set(*node, "outlier_n_min", int64_t{100000});  // 80 of the 960 points below
    test::set(*node, "share", 0.0);
    auto& cloud_port = test::input(*node, "cloud");
    PortAccess::connect(cloud_port, {0, 0, 1, 1000});
    test::set_up(*node);
    test::BoxWriter<Grid> out(*node->outputs()[0]);
    test::Box<PointCloud> cloud({0, 0, 1, 1000});
    cloud->camera = {492.8, 319.5, 239.5, 0.24};
    cloud->sensor_in_robot = mapping_3d::camera_mount(0, 0.3, 1.5, 0, 0);
    for (int i = 0; i < 900; ++i) cloud->points.push_back({0.1f, 0.5f, 2.8f});
    for (int i = 0; i < 60; ++i) cloud->points.push_back({-0.9f, 0.5f, 2.8f});
    test::latch(cloud_port, cloud, 150, 1);
    CHECK(test::run(*node));
    REQUIRE(out.sent());
    Grid& grid = out.message();
    const auto at = [&](double x, double y) {
      return grid.view().at(static_cast<int>((x - grid.origin_x_m) / grid.cell_m),
                            static_cast<int>((y - grid.origin_y_m) / grid.cell_m));
    };
    CHECK(at(0.1, 3.1) == 1000);
    CHECK(at(-0.9, 3.1) == (radius > 0 ? 0 : 1000));
  }
}

TEST_CASE("mapping_3d refuses a range that is empty") {
  NodeTypes types;
  register_mapping_3d(types);
  const auto node = types.find("mapping_3d")->make();
  test::set(*node, "range_min", 7.0);
  CHECK_THROWS_WITH_AS(test::set_up(*node), doctest::Contains("range_min is 7"), SetupError);
}
