// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <optional>
#include <string>

#include "nodes/laser_fusion/evaluate.hpp"
#include "nodes/laser_fusion/laser_fusion.hpp"
#include "rt/memory/memory_use.hpp"
#include "rt/msg/point.hpp"
#include "rt/msg/point_cloud.hpp"
#include "rt/msg/pose.hpp"
#include "rt/sched/port_access.hpp"
#include "rt/testing.hpp"
#include "tests/going_on.hpp"

namespace takt {
void register_laser_fusion(NodeTypes& types);
}

using namespace takt;
using namespace takt::laser_fusion;

namespace {

constexpr Capacity kCapacity{0, 0, 1, 1000};

/// One node on its bench with a generated pair: the camera is mounted a metre away from where the clouds say it is.
struct Bench {
  CloudPair pair = generate_pair({.offset_m = 0.4, .offset_rad = 0.4}, 5);
  NodeTypes types;
  std::unique_ptr<Node> node;
  test::Box<PointCloud> laser{kCapacity}, vision{kCapacity};

  Bench() {
    register_laser_fusion(types);
    node = types.find("laser_fusion")->make();
    for (const char* port : {"laser", "vision"}) PortAccess::connect(test::input(*node, port), kCapacity);
    for (const Point& p : pair.laser.points) laser->points.push_back(p);
    for (size_t i = 0; i < pair.vision.points.size(); ++i) {
      vision->points.push_back(pair.vision.points[i]);
      vision->colours.push_back(pair.vision.colours[i]);
    }
    laser->sensor_in_robot = {0, 0.3, 0.5, 1, 0, 0, 0};
    vision->sensor_in_robot = {0, 0.3, 0.5, 1, 0, 0, 0};
    test::set(*node, "generations", int64_t{6000});
    test::set(*node, "per_job", int64_t{800});
  }
  bool run(uint64_t sequence = 1) {
    test::latch(test::input(*node, "laser"), laser, 150, sequence);
    test::latch(test::input(*node, "vision"), vision, 140, sequence);
    return test::run(*node);
  }
};

}  // namespace

TEST_CASE("laser_fusion searches over several jobs, tells the best so far, and in the end gives coloured points") {
  Bench bench;
  test::set_up(*bench.node);
  test::BoxWriter<Pose> pose(*bench.node->outputs()[0]);
  test::BoxWriter<PointCloud> fused(*bench.node->outputs()[1]), match(*bench.node->outputs()[2]);
  CHECK_FALSE(test::run(*bench.node));  // nothing latched
  int jobs = 0;
  for (; jobs < 20 && !fused.sent(); ++jobs) {
    pose.clear();
    REQUIRE(bench.run());
    REQUIRE(pose.sent());
    CHECK(pose.stamp_ns() == 140);
  }
  CHECK(jobs == 8);
  CHECK(error_of(ego_motion::from_transform(pose.message().transform), bench.pair.vision_in_laser).success());
  CHECK(fused.stamp_ns() == 150);
  CHECK(fused.message().sensor_in_robot.y == 0.3);
  REQUIRE(fused.message().points.size > 600);
  CHECK(fused.message().points.size < 1000);
  REQUIRE(match.sent());
  REQUIRE(match.message().points.size == fused.message().points.size);
  size_t right = 0, certain = 0, from = 0;
  for (uint32_t i = 0; i < fused.message().points.size; ++i) {
    const Point& p = fused.message().points[i];
    while (bench.pair.laser.points[from].x != p.x) ++from;  // in their order
    const Colour &is = fused.message().colours[i], &was = bench.pair.laser.colours[from];
    right += is.b == was.b && is.g == was.g && is.r == was.r;
    CHECK(match.message().colours[i].g >= 25);
    certain += match.message().colours[i].g > 150;
  }
  CHECK(right > fused.message().points.size * 8 / 10);  // at edges the nearest point belongs to something else
  CHECK(certain > fused.message().points.size / 2);
  PortAccess::set_held(test::input(*bench.node, "laser"), 1, false, 1);
  PortAccess::set_held(test::input(*bench.node, "vision"), 1, false, 1);
  CHECK_FALSE(test::run(*bench.node));  // the same pair again
}

TEST_CASE("a job of laser_fusion asks before every portion how much of its budget is left, and the next one goes on") {
  static int64_t used_ns = 0;  // each question finds a millisecond more used up
  constexpr int64_t kBudget_ns = 12'000'000, kReserve_ns = 2'000'000, kPortion_ns = 1'000'000;
  Bench bench;
  test::set(*bench.node, "generations", int64_t{100});
  test::set_up(*bench.node);
  test::BoxWriter<Pose> pose(*bench.node->outputs()[0]);
  test::BoxWriter<PointCloud> fused(*bench.node->outputs()[1]);
  int jobs = 0, poses = 0;
  for (; jobs < 100 && !fused.sent(); ++jobs) {
    test::latch(test::input(*bench.node, "laser"), bench.laser, 150, 1);
    test::latch(test::input(*bench.node, "vision"), bench.vision, 140, 1);
    used_ns = 0;
    pose.clear();
    Job job(test::standing_clock, static_cast<uint64_t>(jobs), 0, 1'000'000'000, 0, "full",
            {kBudget_ns, 0, [] { return used_ns += kPortion_ns; }});
    bench.node->run(job);
    REQUIRE(used_ns <= kBudget_ns - kReserve_ns);
    poses += pose.sent();
  }
  CHECK(fused.sent());
  CHECK(jobs > 5);      // 13 portions of generations, and those of the tables and colours
  CHECK(poses < jobs);  // the first ones have not begun to search
  CHECK(poses > 2);     // the last ones colour
}

TEST_CASE("laser_fusion gives the pose alone where nobody reads its clouds, and spends nothing on colours") {
  int64_t portions[2] = {};
  for (const bool read : {false, true}) {
    Bench bench;
    test::set(*bench.node, "generations", int64_t{8});
    test::set_up(*bench.node);
    test::BoxWriter<Pose> pose(*bench.node->outputs()[0]);
    std::optional<test::BoxWriter<PointCloud>> fused;
    if (read) fused.emplace(*bench.node->outputs()[1]);
    static int64_t asked = 0;
    asked = 0;
    Job job(test::standing_clock, 0, 0, 1'000'000'000, 0, "full", {1'000'000'000, 0, [] { return ++asked; }});
    test::latch(test::input(*bench.node, "laser"), bench.laser, 150, 1);
    test::latch(test::input(*bench.node, "vision"), bench.vision, 140, 1);
    bench.node->run(job);
    CHECK(pose.sent());
    portions[read] = asked;
  }
  CHECK(portions[0] > 5);
  CHECK(portions[0] < portions[1]);
}

TEST_CASE("a fusion that is stopped before every portion gives what one gives in one go") {
  const CloudPair pair = generate_pair({.points = 3000, .offset_m = 0.3, .offset_rad = 0.3}, 4);
  const LaserFusionParameters parameters{.search_points = 300, .vision_points = 2000, .genetic = {.generations = 300}};
  LaserFusion in_one_go(3000, 3000, parameters), in_portions(3000, 3000, parameters);
  in_one_go.begin(pair.laser.points, pair.vision.view(), {}, 1);
  CHECK(in_one_go.run([] { return true; }));
  in_portions.begin(pair.laser.points, pair.vision.view(), {}, 1);
  int stops = 0;
  for (bool stop = false; !in_portions.run([&] { return stop = !stop; }); ++stops) {
  }
  CHECK(stops > 60);
  CHECK(in_portions.vision_in_laser().t == in_one_go.vision_in_laser().t);
  CHECK(in_portions.vision_in_laser().R == in_one_go.vision_in_laser().R);
  const auto one = in_one_go.finish(), other = in_portions.finish();
  REQUIRE(one.size() == other.size());
  CHECK(one.size() > 1500);
  for (size_t i = 0; i < one.size(); ++i) {
    REQUIRE(one[i].point.x == other[i].point.x);
    REQUIRE(one[i].confidence == other[i].confidence);
    REQUIRE(one[i].colour.g == other[i].colour.g);
  }
}

TEST_CASE("a fusion that goes on from what was remembered gives what one gives in one go") {
  const CloudPair pair = generate_pair({.points = 3000, .offset_m = 0.3, .offset_rad = 0.3}, 4);
  const LaserFusionParameters parameters{.search_points = 300, .vision_points = 2000, .genetic = {.generations = 300}};
  const auto make = [&] { return std::make_unique<LaserFusion>(3000, 3000, parameters); };
  auto in_one_go = make(), interrupted = make();
  in_one_go->begin(pair.laser.points, pair.vision.view(), {}, 1);
  CHECK(in_one_go->run([] { return true; }));
  interrupted->begin(pair.laser.points, pair.vision.view(), {}, 1);
  int portions = 0;
  for (int left = 0; !interrupted->run([&] { return left-- > 0; }); left = 5, ++portions)
    interrupted = test::going_on(*interrupted, make());
  CHECK(portions > 10);
  interrupted = test::going_on(*interrupted, make());
  CHECK(interrupted->generation() == in_one_go->generation());
  CHECK(interrupted->share() == in_one_go->share());
  CHECK(interrupted->vision_in_laser().t == in_one_go->vision_in_laser().t);
  CHECK(interrupted->vision_in_laser().R == in_one_go->vision_in_laser().R);
  const auto one = in_one_go->finish(), other = interrupted->finish();
  REQUIRE(one.size() == other.size());
  for (size_t i = 0; i < one.size(); ++i) {
    REQUIRE(one[i].point.x == other[i].point.x);
    REQUIRE(one[i].confidence == other[i].confidence);
    REQUIRE(one[i].colour.g == other[i].colour.g);
  }
  interrupted = test::going_on(*interrupted, make());
  CHECK(interrupted->idle());
}

TEST_CASE("laser_fusion starts from where the sensors are mounted, and holds what is locked") {
  Bench bench;
  const Rigid mount{bench.pair.vision_in_laser.R, bench.pair.vision_in_laser.t + Eigen::Vector3d(0.3, 0.2, 0)};
  bench.vision->sensor_in_robot =
      ego_motion::to_transform(ego_motion::from_transform(bench.laser->sensor_in_robot) * mount);
  test::set(*bench.node, "locked", std::string("z,yaw,pitch,roll"));
  test::set(*bench.node, "generations", int64_t{800});
  test::set_up(*bench.node);
  test::BoxWriter<Pose> pose(*bench.node->outputs()[0]);
  REQUIRE(bench.run());
  const Rigid found = ego_motion::from_transform(pose.message().transform);
  CHECK((found.R - mount.R).norm() < 1e-9);
  CHECK(found.t.z() == doctest::Approx(mount.t.z()));
  CHECK(error_of(found, bench.pair.vision_in_laser).success());
}

TEST_CASE("laser_fusion gives no cloud of two scenes that do not match") {
  Bench bench;
  test::set(*bench.node, "generations", int64_t{80});
  test::set(*bench.node, "share_min", 0.9);
  const CloudPair other = generate_pair({}, 99);
  for (uint32_t i = 0; i < 1000; ++i) bench.vision->points[i] = other.vision.points[i];
  test::set_up(*bench.node);
  test::BoxWriter<Pose> pose(*bench.node->outputs()[0]);
  test::BoxWriter<PointCloud> fused(*bench.node->outputs()[1]);
  CHECK_FALSE(bench.run());
  CHECK(pose.sent());
  CHECK_FALSE(fused.sent());
}

TEST_CASE("laser_fusion names a parameter that cannot be locked, and refuses to lock all") {
  Bench bench;
  test::set(*bench.node, "locked", std::string("z,tilt"));
  CHECK_THROWS_WITH_AS(test::set_up(*bench.node),
                       "locked names \"tilt\", must be words of x, y, z, yaw, pitch, roll with commas between",
                       SetupError);
  test::set(*bench.node, "locked", std::string("x,y,z,yaw,pitch,roll"));
  CHECK_THROWS_AS(test::set_up(*bench.node), SetupError);
}

TEST_CASE("laser_fusion allocates nothing in its jobs") {
  Bench bench;
  test::set(*bench.node, "generations", int64_t{100});
  test::set_up(*bench.node);
  test::BoxWriter<Pose> pose(*bench.node->outputs()[0]);
  test::BoxWriter<PointCloud> fused(*bench.node->outputs()[1]);
  const uint64_t before = thread_memory_use().allocations;
  REQUIRE(bench.run(1));
  fused.clear();
  REQUIRE(bench.run(2));
  CHECK(fused.sent());
  if (counting_allocations()) CHECK(thread_memory_use().allocations == before);
  else MESSAGE("NOT RUN: this program does not count allocations (sanitizer)");
}
