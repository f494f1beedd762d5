// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <memory>

#include "nodes/robot_pose/pose_filter.hpp"
#include "rt/memory/memory_use.hpp"
#include "rt/msg/motion.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/msg/pose.hpp"
#include "rt/sched/port_access.hpp"
#include "rt/testing.hpp"
#include "tests/nanoseconds.hpp"

namespace takt {
void register_robot_pose(NodeTypes& types);
}

using namespace takt;

namespace {

using test::kMs;

/// The node, and messages of a robot that drives along the map's x axis at 0.5 m/s.
struct Fixture {
  std::unique_ptr<Node> node;
  InputPort *wheels, *motion, *robot_motion, *scans;
  std::unique_ptr<test::BoxWriter<Pose>> pose;
  std::unique_ptr<test::BoxWriter<Odometry>> joined;
  test::Box<Odometry> wheel_message;
  test::Box<Motion> motion_message;
  test::Box<Pose> step_message, scan_message;
  uint64_t sequence = 0;

  Fixture() {
    NodeTypes types;
    register_robot_pose(types);
    node = types.find("robot_pose")->make();
    wheels = &test::input(*node, "odometry");
    motion = &test::input(*node, "motion");
    robot_motion = &test::input(*node, "robot_motion");
    scans = &test::input(*node, "scan_pose");
    for (InputPort* port : {wheels, motion, robot_motion, scans}) PortAccess::connect(*port, {});
    test::set_up(*node);
    pose = std::make_unique<test::BoxWriter<Pose>>(*node->outputs()[0]);
    joined = std::make_unique<test::BoxWriter<Odometry>>(*node->outputs()[1]);
  }
  static double way_m(int64_t ms) { return 0.5e-3 * static_cast<double>(ms); }
  static void fill(Pose& message, const PlanarPose& at, double sigma) {
    const UncertainPose p = scan_matching::spatial(at, sigma * sigma * scan_matching::Covariance::Identity());
    message.transform = p.transform;
    std::copy(p.covariance.begin(), p.covariance.end(), message.covariance);
  }
  void wheels_at(int64_t ms, double x0_m = 0) {
    wheel_message->x_m = x0_m + way_m(ms);
    test::latch(*wheels, wheel_message, ms * kMs, ++sequence);
  }
  void motion_over(int64_t from_ms, int64_t to_ms, bool valid = true) {
    motion_message->from_stamp_ns = from_ms * kMs;
    motion_message->valid = valid;
    fill(*step_message, {0, valid ? way_m(to_ms - from_ms) : 7, 0}, 0.002);
    test::latch(*motion, motion_message, to_ms * kMs, ++sequence);
    test::latch(*robot_motion, step_message, to_ms * kMs, sequence);
  }
  void scans_at(int64_t ms) {  // in a frame of its own, where the robot drives along y
    fill(*scan_message, {3, way_m(ms), 0}, 0.01 * std::sqrt(1 + way_m(ms)));
    test::latch(*scans, scan_message, ms * kMs, ++sequence);
  }
  bool run() {
    pose->clear();
    joined->clear();
    return test::run(*node);
  }
  double x_m() { return joined->message().x_m; }
};

}  // namespace

TEST_CASE("robot_pose: begins where the wheels are, joins all three at their own stamps, publishes the newest") {
  Fixture f;
  CHECK_FALSE(f.run());
  f.wheels_at(0, 2);
  CHECK_FALSE(f.run());  // a motion needs two
  f.wheels_at(100, 2);
  REQUIRE(f.run());
  CHECK(f.x_m() == doctest::Approx(2.05).epsilon(0.01));
  CHECK(f.joined->message().theta_rad == doctest::Approx(0).epsilon(0.01));
  for (int64_t ms = 200; ms <= 3000; ms += 100) {
    CAPTURE(ms);
    const uint64_t before = thread_memory_use().allocations;
    f.wheels_at(ms, 2);
    CHECK(f.run());
    if (ms > 400) f.motion_over(ms - 220, ms - 120);  // late
    if (ms > 500) f.scans_at(ms - 240);
    CHECK((f.run() || ms <= 400));
    if (counting_allocations()) CHECK(thread_memory_use().allocations == before);
  }
  CHECK(f.pose->stamp_ns() == 3000 * kMs);
  CHECK(f.x_m() == doctest::Approx(3.5).epsilon(0.01));
  CHECK(f.joined->message().speed_m_s == doctest::Approx(0.5).epsilon(0.02));
  CHECK(f.pose->message().transform.x == doctest::Approx(f.x_m()));
  CHECK(f.pose->message().covariance[0] > 0);
  CHECK_FALSE(f.run());  // nothing new
}

TEST_CASE("robot_pose: goes on without wheels, without scans, and past motions that were not measured") {
  Fixture f;
  f.wheels_at(0);
  f.run();
  f.wheels_at(100);
  CHECK(f.run());
  f.motion_over(0, 100);
  CHECK(f.run());
  for (int64_t ms = 200; ms <= 2000; ms += 100) {  // ego-motion alone
    f.motion_over(ms - 100, ms);
    REQUIRE(f.run());
    CHECK(f.pose->stamp_ns() == ms * kMs);
  }
  CHECK(f.x_m() == doctest::Approx(1.0).epsilon(0.02));
  f.motion_over(2000, 2100, false);
  CHECK(f.run());
  CHECK(f.x_m() == doctest::Approx(1.05).epsilon(0.02));
  for (int64_t ms = 2100; ms <= 4000; ms += 100) {  // scans alone
    f.scans_at(ms);
    f.run();
  }
  CHECK(f.x_m() == doctest::Approx(2.0).epsilon(0.02));
}

TEST_CASE("robot_pose says what must be connected") {
  const auto refused = [](const std::vector<std::string_view>& connected) {
    NodeTypes types;
    register_robot_pose(types);
    const auto node = types.find("robot_pose")->make();
    for (const std::string_view name : connected) PortAccess::connect(test::input(*node, name), {});
    try {
      test::set_up(*node);
    } catch (const SetupError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  CHECK(refused({}).find("nothing to join") != std::string::npos);
  CHECK(refused({"motion"}).find("motion is connected without robot_motion") != std::string::npos);
  CHECK(refused({"odometry", "robot_motion"}).find("robot_motion is connected without motion") != std::string::npos);
  CHECK(refused({"scan_pose"}).empty());
}

TEST_CASE("robot_pose: one that takes another's place goes on from its pose, however the wheels count") {
  Fixture f;
  test::Box<Pose> last;
  Fixture::fill(*last, {7, 2, 0}, 0.1);
  PortAccess::hand_over(*f.node->outputs()[0], &*last);
  f.node->start(0);
  PortAccess::hand_over(*f.node->outputs()[0], nullptr);
  f.wheels_at(5000, -40);
  f.run();
  f.wheels_at(5100, -40);
  REQUIRE(f.run());
  CHECK(std::abs(f.x_m() - 7) < 0.005);  // it looks along y, in its own frame
  CHECK(std::abs(f.joined->message().y_m - 2.05) < 0.005);
  CHECK(f.pose->message().covariance[0] >= 0.01);  // no surer than the one before
}
