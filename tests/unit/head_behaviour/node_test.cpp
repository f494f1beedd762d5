// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>

#include "nodes/mapping_3d/pose.hpp"
#include "rt/memory/memory_use.hpp"
#include "rt/msg/ace/body_poses.hpp"
#include "rt/msg/ace/digital_state.hpp"
#include "rt/msg/ace/head.hpp"
#include "rt/msg/image.hpp"
#include "rt/msg/pose.hpp"
#include "rt/sched/port_access.hpp"
#include "rt/testing.hpp"
#include "tests/nanoseconds.hpp"

namespace takt {
void register_head_behaviour(NodeTypes& types);
}

using namespace takt;
using test::kMs;

namespace {

struct Fixture {
  VirtualClock clock;
  std::unique_ptr<Node> node;
  std::unique_ptr<test::BoxWriter<HeadCommand>> command;
  std::unique_ptr<test::BoxWriter<DigitalState>> lids;
  test::Box<StereoPair> pair;
  test::Box<BodyPoses> bodies{{0, 0, 1, 4}};
  test::Box<Pose> person;
  int64_t now_ns = 0;
  uint64_t jobs = 0;

  Fixture() {
    NodeTypes types;
    register_head_behaviour(types);
    REQUIRE(types.find("head_behaviour")->layer == Layer::processing);
    node = types.find("head_behaviour")->make();
    pair->sensor_in_robot = mapping_3d::camera_mount(0, 0, 1.5, 0, 0);
  }
  void set_up() {
    PortAccess::connect(test::input(*node, "pair"), {});
    PortAccess::connect(test::input(*node, "bodies"), {0, 0, 1, 4});
    PortAccess::connect(test::input(*node, "person"), {});
    test::set_up(*node);
    command = std::make_unique<test::BoxWriter<HeadCommand>>(*node->outputs()[0]);
    lids = std::make_unique<test::BoxWriter<DigitalState>>(*node->outputs()[1]);
  }
  void body(float x_m, float y_m) {
    bodies->bodies.resize(1);
    bodies->bodies[0] = {};
    bodies->bodies[0].joints[0] = {x_m, y_m, 1.5F, 1};
    test::latch(test::input(*node, "bodies"), bodies, now_ns, ++jobs);
  }
  bool job() {
    now_ns += 50 * kMs;
    test::latch(test::input(*node, "pair"), pair, now_ns, ++jobs);
    command->clear(), lids->clear();
    Job job(clock, jobs, now_ns, now_ns + 66 * kMs, 0, "full");
    const uint64_t before = thread_memory_use().allocations;
    node->run(job);
    if (counting_allocations()) CHECK(thread_memory_use().allocations == before);
    for (const char* name : {"bodies", "person"})
      if (InputPort& port = test::input(*node, name); !port.empty()) PortAccess::set_held(port, 1, false, jobs);
    CHECK(lids->sent());
    return command->sent();
  }
  double pan() { return command->message().pan_rad; }
  uint32_t closed() { return lids->message().levels; }
};

}  // namespace

TEST_CASE("head_behaviour looks at who stands before the robot, a body or who is followed, and blinks at him") {
  Fixture f;
  f.set_up();
  REQUIRE(f.job());
  CHECK(f.pan() == 0);
  f.body(-1, 1);
  REQUIRE(f.job());
  CHECK(f.pan() == doctest::Approx(std::acos(-1.0) / 4));
  int blinks = 0;
  for (int k = 0; k < 400; ++k) {  // 20 s
    f.body(-1, 1);
    REQUIRE(f.job());
    blinks += f.closed() == 3 && f.lids->message().changed == 3;
  }
  CHECK(blinks >= 3);
  for (int k = 0; k < 60; ++k) f.job();  // nothing new of him for 3 s
  CHECK(f.pan() == 0);
  CHECK(f.closed() == 0);
  f.person->transform.x = 1, f.person->transform.y = 1;
  test::latch(test::input(*f.node, "person"), f.person, f.now_ns, ++f.jobs);
  f.bodies->bodies.resize(0);
  REQUIRE(f.job());
  CHECK(f.pan() == doctest::Approx(-std::acos(-1.0) / 4));
}

TEST_CASE("head_behaviour shuts both lids against the sun, whether somebody is there or not") {
  Fixture f;
  f.set_up();
  f.pair->health = image_health::saturated;
  f.job();
  f.job();
  CHECK(f.closed() == 0);
  f.job();
  CHECK(f.closed() == 3);
  f.pair->health = 0;
  for (int k = 0; k < 99; ++k) f.job();
  CHECK(f.closed() == 3);
  f.job();
  CHECK(f.closed() == 0);
}

TEST_CASE("head_behaviour commands nothing while it does not know where the camera is, and needs people to look at") {
  Fixture f;
  f.set_up();
  f.pair->sensor_in_robot = {};
  CHECK_FALSE(f.job());
  Fixture nobody;
  CHECK_THROWS_WITH_AS(test::set_up(*nobody.node), doctest::Contains("connect `bodies` or `person`"), SetupError);
}
