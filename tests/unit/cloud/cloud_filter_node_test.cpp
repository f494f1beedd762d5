// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <limits>
#include <string>

#include "rt/memory/memory_use.hpp"
#include "rt/msg/point.hpp"
#include "rt/msg/point_cloud.hpp"
#include "rt/msg/text_status.hpp"
#include "rt/sched/port_access.hpp"
#include "rt/testing.hpp"

namespace takt {
void register_cloud_filter(NodeTypes& types);
}

using namespace takt;

namespace {

constexpr Capacity kCapacity{0, 0, 1, 1000};

/// One node on its bench, with both outputs read.
struct Bench {
  NodeTypes types;
  std::unique_ptr<Node> node;
  test::Box<PointCloud> cloud{kCapacity};

  Bench() {
    register_cloud_filter(types);
    node = types.find("cloud_filter")->make();
    PortAccess::connect(test::input(*node, "cloud"), kCapacity);
    cloud->camera = {492.8, 319.5, 239.5, 0.24};
    cloud->sensor_in_robot.z = 1.6;
    cloud->step_px = 2;
  }
  void add(float x, float y, float z, const Colour& colour = {1, 2, 3}) {
    cloud->points.push_back({x, y, z});
    cloud->colours.push_back(colour);
  }
  bool run(uint64_t sequence = 1) {
    test::latch(test::input(*node, "cloud"), cloud, 150, sequence);
    return test::run(*node);
  }
};

std::string text_of(const TextStatus& status) { return {status.text.data(), status.text.size}; }

}  // namespace

TEST_CASE("cloud_filter without a step passes each cloud on as it came, once") {
  Bench bench;
  test::set_up(*bench.node);
  test::BoxWriter<PointCloud> out(*bench.node->outputs()[0]);
  test::BoxWriter<TextStatus> status(*bench.node->outputs()[1]);
  CHECK_FALSE(test::run(*bench.node));  // nothing latched
  bench.add(1, 2, 3);
  bench.add(4, 5, std::numeric_limits<float>::infinity(), {7, 8, 9});
  REQUIRE(bench.run());
  REQUIRE(out.sent());
  CHECK(out.stamp_ns() == 150);
  CHECK(out.message().step_px == 2);
  CHECK(out.message().camera.focal_px == 492.8);
  CHECK(out.message().sensor_in_robot.z == 1.6);
  REQUIRE(out.message().points.size == 2);
  CHECK(out.message().points[1].y == 5);
  CHECK(out.message().colours[1].r == 9);
  CHECK(status.sent());
  CHECK(text_of(status.message()) == "2 in, 0 unusable, 0 lost");
  out.clear();
  PortAccess::set_held(test::input(*bench.node, "cloud"), 1, false, 1);
  CHECK_FALSE(test::run(*bench.node));  // the same cloud again
  CHECK_FALSE(out.sent());
}

TEST_CASE("cloud_filter does its steps in order and tells what became of the cloud") {
  Bench bench;
  test::set(*bench.node, "outlier_radius", 0.31);
  test::set(*bench.node, "outlier_n_min", int64_t{30000});  // 10 of the 403 points below
  test::set(*bench.node, "interpolate", 0.1);
  test::set(*bench.node, "capacity", int64_t{3000});  // a plane is filled in above and below itself as well
  test::set(*bench.node, "smooth", 0.1);
  test::set(*bench.node, "reduce", 0.2);
  test::set_up(*bench.node);
  test::BoxWriter<PointCloud> out(*bench.node->outputs()[0]);
  test::BoxWriter<TextStatus> status(*bench.node->outputs()[1]);
  for (int i = 0; i < 400; ++i)  // a plane of voxel centres with a hole
    if (i != 210)
      bench.add(0.05f + 0.1f * static_cast<float>(i % 20), 0.05f + 0.1f * static_cast<float>(i / 20), 1.04f);
  bench.add(5, 5, 5);
  bench.add(-5, 5, 5);
  bench.add(std::numeric_limits<float>::quiet_NaN(), 0, 0);
  bench.add(0, 9, 9);
  REQUIRE(bench.run());
  REQUIRE(out.sent());
  CHECK(text_of(status.message()).starts_with("403 in, outliers 399, interpolate "));
  CHECK(text_of(status.message()).ends_with(", reduce 100, 1 unusable, 0 lost"));
  CHECK(out.message().colours.size == 100);
  for (const Point& p : out.message().points.items()) CHECK(p.z == doctest::Approx(1.04));
}

TEST_CASE("cloud_filter counts what has no room") {
  Bench bench;
  test::set(*bench.node, "smooth", 0.1);
  test::set(*bench.node, "t_occ", 0.0);
  test::set_up(*bench.node);
  test::BoxWriter<PointCloud> out(*bench.node->outputs()[0]);
  test::BoxWriter<TextStatus> status(*bench.node->outputs()[1]);
  for (int i = 0; i < 1000; ++i)
    bench.add(static_cast<float>(i % 10), static_cast<float>(i / 10 % 10), static_cast<float>(i / 100));
  REQUIRE(bench.run());
  CHECK(out.message().points.size == 1000);
  CHECK(text_of(status.message()) == "1000 in, smooth 1000, 0 unusable, 18000 lost");  // each grows to 19 voxels
  CHECK(bench.node->outputs()[0]->capacity().count == 1000);

  Bench larger;
  test::set(*larger.node, "capacity", int64_t{20000});
  test::set_up(*larger.node);
  CHECK(larger.node->outputs()[0]->capacity().count == 20000);
}

TEST_CASE("cloud_filter keeps a cloud without colours without, and allocates nothing") {
  Bench bench;
  test::set(*bench.node, "outlier_radius", 0.3);
  test::set(*bench.node, "interpolate", 0.1);
  test::set(*bench.node, "smooth", 0.1);
  test::set(*bench.node, "reduce", 0.2);
  test::set_up(*bench.node);
  test::BoxWriter<PointCloud> out(*bench.node->outputs()[0]);
  test::BoxWriter<TextStatus> status(*bench.node->outputs()[1]);
  for (int i = 0; i < 900; ++i)
    bench.cloud->points.push_back({0.1f * static_cast<float>(i % 30), 0.1f * static_cast<float>(i / 30), 1});
  test::latch(test::input(*bench.node, "cloud"), bench.cloud, 150, 1);
  const uint64_t before = thread_memory_use().allocations;
  CHECK(test::run(*bench.node));
  if (counting_allocations()) CHECK(thread_memory_use().allocations == before);
  else MESSAGE("NOT RUN: this program does not count allocations (sanitizer)");
  CHECK(out.message().points.size > 100);
  CHECK(out.message().colours.size == 0);
}

TEST_CASE("cloud_filter refuses what it cannot work with") {
  Bench fine;
  test::set(*fine.node, "reduce", 0.0001);
  CHECK_THROWS_WITH_AS(test::set_up(*fine.node), doctest::Contains("reduce is 0.0001 m, must be 0"), SetupError);
  Bench large;
  test::set(*large.node, "reduce", 0.1);
  PortAccess::connect(test::input(*large.node, "cloud"), {0, 0, 1, (1u << 24) + 1});
  CHECK_THROWS_WITH_AS(test::set_up(*large.node), doctest::Contains("at most 2^24 points"), SetupError);
}
