// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "nodes/body_pose/generated_scene.hpp"
#include "nodes/mapping_3d/pose.hpp"
#include "rt/memory/memory_use.hpp"
#include "rt/msg/ace/body_poses.hpp"
#include "rt/msg/point.hpp"
#include "rt/msg/point_cloud.hpp"
#include "rt/sched/port_access.hpp"
#include "rt/testing.hpp"

namespace takt {
void register_body_pose(NodeTypes& types);
}

using namespace takt;

namespace {

const std::string kSkeletons = std::string(TAKT_SOURCE_DIR) + "/graph/skeletons/";

/// One node on its bench before a generated person.
struct Bench {
  NodeTypes types;
  std::unique_ptr<Node> node;
  body_pose::GeneratedScene scene =
      body_pose::make_person(body_pose::read_skeleton(kSkeletons + "human.txt"), {}, 1, 0, false);
  Capacity capacity{0, 0, 1, static_cast<uint32_t>(scene.points.size())};
  test::Box<PointCloud> cloud{capacity};

  Bench() {
    register_body_pose(types);
    node = types.find("body_pose")->make();
    PortAccess::connect(test::input(*node, "cloud"), capacity);
    test::set(*node, "skeleton", kSkeletons + "human.txt");
    for (const Point& p : scene.points) cloud->points.push_back(p);
    cloud->sensor_in_robot = scene.camera_in_floor;
  }
  bool run(uint64_t sequence) {
    test::latch(test::input(*node, "cloud"), cloud, 150, sequence);
    return test::run(*node);
  }
};

}  // namespace

TEST_CASE("body_pose: the person before the robot, in the robot frame, once for each cloud") {
  Bench bench;
  test::set_up(*bench.node);
  test::BoxWriter<BodyPoses> out(*bench.node->outputs()[0]);
  CHECK_FALSE(test::run(*bench.node));  // nothing latched
  REQUIRE(bench.run(1));
  REQUIRE(out.sent());
  CHECK(out.stamp_ns() == 150);
  const BodyPoses& poses = out.message();
  CHECK(poses.joints == 16);
  CHECK(poses.searched == 1);
  REQUIRE(poses.bodies.size == 1);
  const BodyJoint& head = poses.bodies[0].joints[0];
  CHECK(head.fitted == 1);
  CHECK(std::abs(head.x - bench.scene.body.joints[0].x()) < 0.15);
  CHECK(std::abs(head.y - bench.scene.body.joints[0].y()) < 0.15);
  CHECK(std::abs(head.z - bench.scene.body.joints[0].z()) < 0.15);
  out.clear();
  test::latch(test::input(*bench.node, "cloud"), bench.cloud, 150, 1);
  PortAccess::set_held(test::input(*bench.node, "cloud"), 1, false, 1);
  CHECK_FALSE(test::run(*bench.node));  // the same cloud again
  CHECK_FALSE(out.sent());
}

TEST_CASE("body_pose: where the cloud does not say how the camera is mounted, the floor does; nothing is allocated") {
  Bench bench;
  test::set_up(*bench.node);
  test::BoxWriter<BodyPoses> out(*bench.node->outputs()[0]);
  bench.cloud->sensor_in_robot = {};
  const uint64_t before = thread_memory_use().allocations;
  REQUIRE(bench.run(1));
  if (counting_allocations()) CHECK(thread_memory_use().allocations == before);
  REQUIRE(out.message().bodies.size == 1);
  CHECK(std::abs(out.message().bodies[0].joints[0].z - bench.scene.body.joints[0].z()) < 0.2);
  // A cloud without a floor says nothing.
  bench.cloud->points.resize(0);
  CHECK_FALSE(bench.run(2));
}

TEST_CASE("body_pose refuses a skeleton that cannot be read, with its name") {
  Bench bench;
  test::set(*bench.node, "skeleton", std::string("/nowhere/horse.txt"));
  CHECK_THROWS_WITH_AS(test::set_up(*bench.node), doctest::Contains("/nowhere/horse.txt"), SetupError);
}
