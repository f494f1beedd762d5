// SPDX-License-Identifier: Apache-2.0
// Several robots in one world: what they see of each other, and that they do not run into each other.
#include <doctest/doctest.h>

#include "hal/sim/sim_devices.hpp"
#include "tests/unit/sim/acting_world.hpp"
#include "tests/unit/sim/small_world.hpp"

using namespace takt;
using namespace takt::sim;
using test::kMs;
using test::kSecond;

TEST_CASE("robots of one world share its time and its objects, and each has its own base, head and noise") {
  const auto stage = test::acting_stage();
  Simulation ace(stage, 0), bea(stage, 1);
  CHECK(ace.begin(100) == 100);
  CHECK(bea.begin(200) == 100);
  for (int64_t t = 100; t < 2 * kSecond; t += 50 * kMs) {
    ace.command_base(0.4, 0, t);
    ace.advance_base(t);
    bea.advance_base(t);
    bea.command_head(0.3, 0, t);
    bea.advance_head(t);
  }
  CHECK(ace.robot(2 * kSecond).x_m > 1.8);
  CHECK(bea.robot(2 * kSecond).x_m == 1.5);
  CHECK(ace.head(2 * kSecond).pan_rad == 0);
  CHECK(bea.head(2 * kSecond).pan_rad > 0.1);
  CHECK(ace.seed() == stage->seed());
  CHECK(bea.seed() != ace.seed());
}

TEST_CASE("a robot is seen by the laser and the camera of another one, where it then is") {
  const auto stage = test::acting_stage(R"(<client name="cid" x="5m" y="4.2m" theta="180deg"/>)");
  Simulation ace(stage, 0), bea(stage, 1), cid(stage, 2);
  SimLaser laser("laser", {}, ace);
  REQUIRE(laser.open().has_value());
  REQUIRE(laser.start(0).has_value());
  std::vector<float> range(181);
  const auto left = [&](int64_t at_ns) {
    REQUIRE(laser.read(range, at_ns, INT64_MAX).status == ReadStatus::ok);
    return static_cast<double>(range[180]);
  };
  const StereoRig rig = test::small_rig();
  std::vector<float> before(static_cast<size_t>(rig.width * rig.height)), after(before);
  CHECK(left(10 * kMs) == doctest::Approx(1.1 - 0.28).epsilon(0.05));
  cid.true_depth(rig, 10 * kMs, before.data());
  for (int64_t t = 0; t < 4 * kSecond; t += 50 * kMs) {
    if (t < 2 * kSecond) bea.command_base(0.5, 0.6, t);  // away from beside ace, and nearer to cid
    bea.advance_base(t);
  }
  CHECK(left(4 * kSecond) == doctest::Approx(5.5 - 2.7).epsilon(0.02));
  cid.true_depth(rig, 4 * kSecond, after.data());
  CHECK(before != after);
}

TEST_CASE("two robots that drive at each other stop before they touch, and may part") {
  const auto stage = test::acting_stage(R"(<client name="cid" x="5.5m" y="2.7m" theta="180deg"/>)");
  Simulation ace(stage, 0), cid(stage, 2);
  ace.begin(0);
  const auto drive = [&](double speed, int64_t from_ns, int64_t to_ns) {
    double nearest = 1e9;
    for (int64_t t = from_ns; t < to_ns; t += 50 * kMs) {
      for (Simulation* s : {&ace, &cid}) {
        s->command_base(speed, 0, t);
        s->advance_base(t);
      }
      nearest = std::min(nearest, cid.robot(t).x_m - ace.robot(t).x_m);
    }
    return nearest;
  };
  const double nearest = drive(1.4, 0, 6 * kSecond);
  CHECK(nearest >= 2 * kFootprintRadius);
  CHECK(nearest < 2 * kFootprintRadius + 0.4);
  CHECK(ace.blocked());
  drive(-0.5, 6 * kSecond, 9 * kSecond);
  CHECK(cid.robot(9 * kSecond).x_m - ace.robot(9 * kSecond).x_m > nearest + 1);
}

TEST_CASE("a client's name is unique, and one that there is not is told with those that there are") {
  const auto stage = test::acting_stage();
  CHECK(*Simulation::find_client(*stage, "laser", "w.xml", "") == 0);
  CHECK(*Simulation::find_client(*stage, "laser", "w.xml", "bea") == 1);
  const auto none = Simulation::find_client(*stage, "laser", "w.xml", "dan");
  REQUIRE_FALSE(none);
  CHECK(none.error().text().find("ace, bea") != std::string::npos);
}
