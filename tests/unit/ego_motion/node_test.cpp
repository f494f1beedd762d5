// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>

#include "rt/msg/disparity.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/image.hpp"
#include "rt/msg/motion.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/msg/pose.hpp"
#include "rt/sched/port_access.hpp"
#include "rt/testing.hpp"

namespace takt {
void register_ego_motion(NodeTypes& types);
}

using namespace takt;

namespace {

constexpr Capacity kSize{320, 240, 1, 0};

/// A textured wall 4 m ahead, the camera moved to the right by `x_m`.
void render(StereoPair& pair, DisparityMap& map, double x_m) {
  pair.width = map.width = 320;
  pair.height = map.height = 240;
  pair.channels = 1;
  pair.camera = map.camera = {250, 159.5, 119.5, 0.2};
  pair.left.resize(320 * 240), pair.right.resize(320 * 240), map.disparity.resize(320 * 240);
  const auto texture = [](double x, double y) {
    return static_cast<uint8_t>(
        std::lround(120 + 40 * std::sin(9 * x + 2 * std::sin(5 * y)) + 40 * std::sin(11 * y + 3 * std::sin(4 * x))));
  };
  for (int v = 0; v < 240; ++v)
    for (int u = 0; u < 320; ++u) {
      const double x = (u - 159.5) * 4 / 250 + x_m, y = (v - 119.5) * 4 / 250;
      pair.left_view().at(u, v) = texture(x, y);
      pair.right_view().at(u, v) = texture(x + 0.2, y);
      map.view().at(u, v) = 13;  // 12.5 px in truth
    }
}

}  // namespace

TEST_CASE("ego_motion: keyframe, then motion with both stamps; nothing for old or unequal stamps") {
  NodeTypes types;
  register_ego_motion(types);
  const auto node = types.find("ego_motion")->make();
  auto& pair_port = test::input(*node, "pair");
  auto& map_port = test::input(*node, "disparity");
  PortAccess::connect(pair_port, kSize);
  PortAccess::connect(map_port, kSize);
  test::set_up(*node);
  test::BoxWriter<Motion> out(*node->outputs()[0]);
  test::BoxWriter<Pose> pose(*node->outputs()[1]), robot(*node->outputs()[2]);
  test::Box<StereoPair> pair(kSize);
  test::Box<DisparityMap> map(kSize);
  const auto step = [&](int64_t pair_stamp, int64_t map_stamp, uint64_t sequence) {
    out.clear(), pose.clear(), robot.clear();
    test::latch(pair_port, pair, pair_stamp, sequence);
    test::latch(map_port, map, map_stamp, sequence);
    return test::run(*node, sequence);
  };
  render(*pair, *map, 0);
  CHECK(step(1'000, 1'000, 1));
  REQUIRE(out.sent());
  CHECK(out.message().keyframe == 1);
  CHECK(out.message().from_stamp_ns == 1'000);

  render(*pair, *map, 0.05);
  CHECK(step(101'000, 101'000, 2));
  REQUIRE(out.sent());
  CHECK(out.stamp_ns() == 101'000);
  CHECK(out.message().from_stamp_ns == 1'000);
  CHECK(out.message().keyframe == 0);
  CHECK(out.message().valid == 1);
  CHECK(std::abs(out.message().camera_in_previous.x - 0.05) < 0.003);
  CHECK(out.message().pose.x == out.message().camera_in_previous.x);
  CHECK(out.message().inliers > 50);
  REQUIRE(pose.sent());
  CHECK(pose.stamp_ns() == 101'000);
  CHECK(pose.message().transform.x == out.message().pose.x);
  CHECK(pose.message().covariance[0] > 0);
  // The camera looks along the robot's y axis, both have x to the right: M_robot moves along x as well.
  REQUIRE(robot.sent());
  CHECK(robot.message().transform.x == doctest::Approx(out.message().camera_in_previous.x).epsilon(0.02));
  CHECK(std::abs(robot.message().transform.z - out.message().camera_in_previous.y * -1) < 0.003);
  CHECK(robot.message().covariance[0] > 0);

  CHECK_FALSE(step(101'000, 101'000, 3));
  CHECK_FALSE(out.sent());
  CHECK_FALSE(step(201'000, 101'000, 4));
  CHECK_FALSE(out.sent());
  pair->camera.focal_px = 0;  // not rectified
  CHECK_FALSE(step(301'000, 301'000, 5));
  CHECK_FALSE(out.sent());
}

TEST_CASE("ego_motion refuses a disparity of another size and an even block") {
  NodeTypes types;
  register_ego_motion(types);
  const auto node = types.find("ego_motion")->make();
  PortAccess::connect(test::input(*node, "pair"), {640, 480, 3, 0});
  PortAccess::connect(test::input(*node, "disparity"), {320, 240, 1, 0});
  CHECK_THROWS_WITH_AS(test::set_up(*node), doctest::Contains("640 x 480"), SetupError);
  PortAccess::connect(test::input(*node, "disparity"), {640, 480, 1, 0});
  test::set(*node, "n_search", int64_t{10});
  CHECK_THROWS_WITH_AS(test::set_up(*node), doctest::Contains("n_search is 10"), SetupError);
}

TEST_CASE(
    "ego_motion conjugates with the mount: a robot that turns on the spot moves its camera, and odometry says so") {
  NodeTypes types;
  register_ego_motion(types);
  const auto node = types.find("ego_motion")->make();
  auto& pair_port = test::input(*node, "pair");
  auto& map_port = test::input(*node, "disparity");
  auto& odometry_port = test::input(*node, "odometry");
  PortAccess::connect(pair_port, kSize);
  PortAccess::connect(map_port, kSize);
  PortAccess::connect(odometry_port, {});
  test::set(*node, "predict", std::string("odometry"));
  test::set(*node, "camera_y", 0.5);
  test::set_up(*node);
  test::BoxWriter<Motion> out(*node->outputs()[0]);
  test::BoxWriter<Pose> pose(*node->outputs()[1]), robot(*node->outputs()[2]);
  test::Box<StereoPair> pair(kSize);
  test::Box<DisparityMap> map(kSize);
  test::Box<Odometry> odometry[3];
  const double turn = 0.1;
  for (size_t i = 0; i < 3; ++i) odometry[i]->theta_rad = turn * static_cast<double>(i) / 2;  // 0, 50 and 100 ms
  render(*pair, *map, 0);
  for (const int64_t stamp : {int64_t{0}, int64_t{100'000'000}}) {
    out.clear(), pose.clear(), robot.clear();
    test::latch(pair_port, pair, stamp, static_cast<uint64_t>(stamp) + 1);
    test::latch(map_port, map, stamp, static_cast<uint64_t>(stamp) + 1);
    for (size_t i = 0; i < 3; ++i)
      test::latch(odometry_port, odometry[i], static_cast<int64_t>(i) * 50'000'000, i + 1, i);
    CHECK(test::run(*node));
    // Nothing to see in the second image: the odometry answers.
    for (uint8_t& v : pair->left.items()) v = 100;
  }
  REQUIRE(out.sent());
  CHECK(out.message().valid == 0);
  // A camera 0.5 m before the axis swings to the left; turning left is turning about its y axis, which looks down.
  const Transform& camera = out.message().camera_in_previous;
  CHECK(camera.x == doctest::Approx(-0.5 * std::sin(turn)));
  CHECK(camera.z == doctest::Approx(-0.5 * (1 - std::cos(turn))));
  CHECK(2 * std::atan2(camera.qy, camera.qw) == doctest::Approx(-turn));
  const Transform& base = robot.message().transform;
  CHECK(std::abs(base.x) < 1e-12);
  CHECK(std::abs(base.y) < 1e-12);
  CHECK(2 * std::atan2(base.qz, base.qw) == doctest::Approx(turn));
}

TEST_CASE("ego_motion goes on where another process left off, unsure of the time between") {
  NodeTypes types;
  register_ego_motion(types);
  const auto node = types.find("ego_motion")->make();
  auto& pair_port = test::input(*node, "pair");
  auto& map_port = test::input(*node, "disparity");
  PortAccess::connect(pair_port, kSize);
  PortAccess::connect(map_port, kSize);
  test::set_up(*node);
  test::Box<Motion> last_motion;
  test::Box<Pose> last_pose;
  last_motion->from_stamp_ns = 1'000'000'000;
  last_pose->transform.x = 7;
  last_pose->covariance[0] = 0.01;
  PortAccess::hand_over(*node->outputs()[0], &*last_motion);
  PortAccess::hand_over(*node->outputs()[1], &*last_pose);
  node->start(0);
  test::BoxWriter<Motion> out(*node->outputs()[0]);
  test::BoxWriter<Pose> pose(*node->outputs()[1]);
  test::Box<StereoPair> pair(kSize);
  test::Box<DisparityMap> map(kSize);
  render(*pair, *map, 0);
  test::latch(pair_port, pair, 1'400'000'000, 1);
  test::latch(map_port, map, 1'400'000'000, 1);
  CHECK(test::run(*node));
  CHECK(out.message().valid == 0);
  CHECK(out.message().keyframe == 0);
  CHECK(pose.message().transform.x == 7);
  CHECK(pose.message().covariance[0] == doctest::Approx(0.01 + 0.16 * 0.16));
}

TEST_CASE("ego_motion wants the odometry connected that it shall predict from") {
  NodeTypes types;
  register_ego_motion(types);
  const auto node = types.find("ego_motion")->make();
  PortAccess::connect(test::input(*node, "pair"), kSize);
  PortAccess::connect(test::input(*node, "disparity"), kSize);
  test::set(*node, "predict", std::string("odometry"));
  CHECK_THROWS_WITH_AS(test::set_up(*node), doctest::Contains("input odometry is not connected"), SetupError);
}
