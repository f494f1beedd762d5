// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>

#include "nodes/person_tracking/evaluate.hpp"
#include "rt/memory/memory_use.hpp"
#include "rt/msg/ace/detections.hpp"
#include "rt/msg/image.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/msg/pose.hpp"
#include "rt/msg/velocity_command.hpp"
#include "rt/sched/port_access.hpp"
#include "rt/testing.hpp"

namespace takt {
void register_person_tracking(NodeTypes& types);
}

using namespace takt;
using namespace takt::person_tracking;

namespace {

/// The node on its bench before a generated walk.
struct Bench {
  WalkParameters walk_parameters = [] {
    WalkParameters p;
    p.second_person = p.posts = false;
    p.light_min = p.light_max = 1;
    return p;
  }();
  GeneratedWalk walk{walk_parameters, 1, 0};
  NodeTypes types;
  std::unique_ptr<Node> node;
  Capacity capacity{640, 480, 3, 0};
  test::Box<StereoPair> pair{capacity};
  test::Box<Odometry> odometry;
  WalkFrame truth;
  uint64_t sequence = 0;

  Bench() {
    register_person_tracking(types);
    node = types.find("person_tracking")->make();
    PortAccess::connect(test::input(*node, "pair"), capacity);
  }
  bool step() {
    truth = walk.next();
    pair->width = 640;
    pair->height = 480;
    pair->channels = 3;
    pair->camera = walk.camera();
    pair->sensor_in_robot = walk.camera_in_robot();
    pair->left.resize(truth.left.size());
    std::copy(truth.left.begin(), truth.left.end(), pair->left.data());
    *odometry = truth.odometry;
    test::latch(test::input(*node, "pair"), pair, truth.stamp_ns, ++sequence);
    test::latch(test::input(*node, "odometry"), odometry, truth.stamp_ns, sequence);
    return test::run(*node);
  }
};

}  // namespace

TEST_CASE("person_tracking: the person's place and the set-point; unseen he is soon nobody, and the robot stands") {
  Bench bench;
  test::set_up(*bench.node);
  test::BoxWriter<Pose> person(*bench.node->outputs()[0]);
  test::BoxWriter<Detections> shirts(*bench.node->outputs()[1]);
  test::BoxWriter<VelocityCommand> command(*bench.node->outputs()[2]);
  CHECK_FALSE(test::run(*bench.node));  // no image: the set-point comes all the same
  CHECK(command.sent());
  CHECK(command.message().speed_m_s == 0);
  CHECK_FALSE(person.sent());
  for (int i = 0; i < 10; ++i) {
    person.clear(), shirts.clear(), command.clear();
    REQUIRE(bench.step());
  }
  REQUIRE(person.sent());
  CHECK(person.stamp_ns() == bench.truth.stamp_ns);
  const Pose& found = person.message();
  CHECK(std::hypot(found.transform.x - bench.truth.person.x(), found.transform.y - bench.truth.person.y()) < 0.4);
  CHECK(found.covariance[0] > 0);
  CHECK(found.covariance[7] > 0);
  CHECK(found.covariance[35] > 0);
  REQUIRE(shirts.message().boxes.size >= 1);
  CHECK(shirts.message().boxes[0].class_id == 1);
  CHECK(command.message().speed_m_s > 0);
  // Two seconds later an empty image.
  const uint64_t before = thread_memory_use().allocations;
  test::latch(test::input(*bench.node, "pair"), bench.pair, bench.truth.stamp_ns + 2'000'000'000, bench.sequence + 1);
  std::fill_n(bench.pair->left.data(), bench.pair->left.size, uint8_t{90});
  person.clear(), command.clear();
  REQUIRE(test::run(*bench.node));
  if (counting_allocations()) CHECK(thread_memory_use().allocations == before);
  CHECK_FALSE(person.sent());  // nobody any more
  REQUIRE(command.sent());
  CHECK(command.message().speed_m_s == 0);
  CHECK(command.message().turn_rad_s == 0);
}

TEST_CASE("person_tracking: an image that is not rectified, or of a camera nobody knows where, gives no result") {
  Bench bench;
  test::set_up(*bench.node);
  test::BoxWriter<Pose> person(*bench.node->outputs()[0]);
  REQUIRE(bench.step());
  bench.pair->camera = {};
  test::latch(test::input(*bench.node, "pair"), bench.pair, 1, ++bench.sequence);
  CHECK_FALSE(test::run(*bench.node));
  bench.pair->camera = bench.walk.camera();
  bench.pair->sensor_in_robot = {};
  test::latch(test::input(*bench.node, "pair"), bench.pair, 2, ++bench.sequence);
  CHECK_FALSE(test::run(*bench.node));
}

TEST_CASE("generated walks: equal seeds give equal walks; the person is before the robot and mostly in view") {
  const WalkParameters p;
  GeneratedWalk a(p, 3, 1), b(p, 3, 1), c(p, 4, 1);
  const WalkFrame &first = a.next(), &second = b.next();
  CHECK(first.left == second.left);
  CHECK(first.right == second.right);
  CHECK(first.left != c.next().left);
  CHECK(first.person.y() > 1);
  CHECK(first.visible > 0.2);
}

TEST_CASE("a walk is tracked better than by holding what was last seen") {
  WalkParameters p;
  p.posts = false;
  const WalkFigures f = measure_walks(p, {}, 2, 1, 60);
  CHECK(f.frames == 60);
  CHECK(f.shown > 30);
  CHECK(f.wrong_sightings == 0);
  CHECK(f.filter.false_locks == 0);
  CHECK(f.filter.tracked_shown >= f.shown * 8 / 10);
}
