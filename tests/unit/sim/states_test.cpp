// SPDX-License-Identifier: Apache-2.0
// Objects whose state, look and place change in time, as sensors and robots meet them.
#include <doctest/doctest.h>

#include <thread>

#include "hal/sim/sim_camera.hpp"
#include "hal/sim/sim_devices.hpp"
#include "tests/conformance/stereo_camera.hpp"
#include "tests/unit/sim/acting_world.hpp"
#include "tests/unit/sim/small_world.hpp"

using namespace takt;
using namespace takt::sim;
using test::exposure;
using test::kEpoch;
using test::kMs;
using test::kSecond;

namespace {

struct Laser {
  explicit Laser(Simulation& s) : laser("laser", {}, s), range(181) {
    REQUIRE(laser.open().has_value());
    REQUIRE(laser.start(kEpoch).has_value());
  }
  double ahead(int64_t at_ns) {
    REQUIRE(laser.read(range, at_ns, INT64_MAX).status == ReadStatus::ok);
    return static_cast<double>(range[90]);
  }
  SimLaser laser;
  std::vector<float> range;
};

}  // namespace

TEST_CASE("a track keeps the order of changes, and the newest of many") {
  Track track;
  CHECK_FALSE(track.newest(INT64_MAX));
  for (int32_t i = 0; i < 200; ++i) track.append({10 * i, i});
  CHECK(track.newest(1990)->value == 199);
  CHECK(track.newest(1989)->value == 198);
  CHECK(track.newest(1700)->value == 170);
  CHECK(track.newest(0)->value == 137);  // forgotten: the oldest that is kept
  Track two;
  two.append({5, 1});
  two.append({5, 2});
  CHECK(two.newest(5)->value == 2);
  CHECK_FALSE(two.newest(4));
}

TEST_CASE("attributes and places are what the world says until an event or an action changes them") {
  Simulation s(test::acting_stage(R"(<event at="2s" object="cup" attr="level" value="full"/>
      <event at="1s" object="crate" x="3m" y="2m" yaw="90deg"/><event at="3s" object="crate" to="away"/>)"),
               0);
  s.begin(kEpoch);
  CHECK(s.attribute("cup", "level", kEpoch) == "empty");
  CHECK(s.attribute("cup", "level", kEpoch + 2 * kSecond - 1) == "empty");
  CHECK(s.attribute("cup", "level", kEpoch + 2 * kSecond) == "full");
  CHECK(s.attribute("bottle", "closed", kEpoch) == "true");
  CHECK_FALSE(s.attribute("cup", "colour", kEpoch));
  CHECK_FALSE(s.attribute("cupboard", "level", kEpoch));
  CHECK(s.position("crate", kEpoch) == Vec2(5.5, 5));
  CHECK(s.position("crate", kEpoch + kSecond) == Vec2(3, 2));
  CHECK_FALSE(s.position("crate", kEpoch + 3 * kSecond));
  CHECK_FALSE(s.position("chair", kEpoch));
  CHECK(s.position("table", kEpoch) == Vec2(0.95, 3.25));
}

TEST_CASE("a door that closes is seen by lasers and cameras, and stops the robot") {
  Simulation s(test::acting_stage(R"(<event at="2s" object="door" attr="closed" value="true"/>
      <event at="6s" object="door" attr="closed" value="false"/>)"),
               0);
  s.begin(kEpoch);
  Laser laser(s);
  CHECK(laser.ahead(kEpoch + kSecond) == doctest::Approx(5.0).epsilon(0.01));       // the wall
  CHECK(laser.ahead(kEpoch + 3 * kSecond) == doctest::Approx(2.45).epsilon(0.02));  // the door
  CHECK(laser.ahead(kEpoch + 7 * kSecond) == doctest::Approx(5.0).epsilon(0.01));

  const StereoRig rig = test::small_rig();
  std::vector<float> open(static_cast<size_t>(rig.width * rig.height)), closed(open);
  s.true_depth(rig, kEpoch + kSecond, open.data());
  s.true_depth(rig, kEpoch + 3 * kSecond, closed.data());
  const size_t middle = open.size() / 2 + static_cast<size_t>(rig.width) / 2;
  CHECK(closed[middle] < 0.8f * open[middle]);

  bool blocked = false;
  for (int64_t t = 0; t < 12 * kSecond; t += 20 * kMs) {
    s.command_base(0.6, 0, kEpoch + t);
    s.advance_base(kEpoch + t);
    blocked |= s.blocked();
    const double x = s.robot(kEpoch + t).x_m;
    if (t > 2 * kSecond && t < 6 * kSecond) CHECK(x < 3.95 - kFootprintRadius + 0.01);
  }
  CHECK(blocked);
  CHECK(s.robot(kEpoch + 12 * kSecond).x_m > 4.5);
}

TEST_CASE("an obstacle moved into the way stops the robot; out of one that is put onto it it may drive") {
  Simulation s(test::acting_stage(R"(<event at="1s" object="crate" x="3.5m" y="2.7m"/>)"), 0);
  s.begin(kEpoch);
  for (int64_t t = 0; t < 8 * kSecond; t += 20 * kMs) {
    s.command_base(0.6, 0, kEpoch + t);
    s.advance_base(kEpoch + t);
  }
  CHECK(s.robot(kEpoch + 8 * kSecond).x_m == doctest::Approx(3.25 - kFootprintRadius).epsilon(0.01));
  Simulation under(test::acting_stage(R"(<event at="1s" object="crate" x="1.4m" y="2.7m"/>)"), 0);
  under.begin(kEpoch);
  for (int64_t t = 0; t < 8 * kSecond; t += 20 * kMs) {
    under.command_base(0.3, 0, kEpoch + t);
    under.advance_base(kEpoch + t);
  }
  CHECK(under.robot(kEpoch + 8 * kSecond).x_m > 3);
}

TEST_CASE("what may change is met as if it never did, until it does") {
  const auto still = test::small_simulation();
  World world = test::small_world();
  world.events.push_back({1.0, "box", "", "", false, {2.0, 4.0}, 0.4});
  Simulation moving(world, 0, 3);
  still->begin(0), moving.begin(0);
  std::vector<float> before(181), after(181);
  Snapshot met = moving.make_snapshot(), none = still->make_snapshot();
  scan(*still, {}, 0, before, none);
  scan(moving, {}, 0, after, met);
  CHECK(before == after);
  scan(moving, {}, 2 * kSecond, after, met);
  scan(*still, {}, 2 * kSecond, before, none);
  CHECK(before != after);
}

TEST_CASE("an exposure shows the state of its instant, whoever renders it and when") {
  const auto with_action = [](const Clock& clock, bool background, int64_t epoch) {
    const auto stage = test::acting_stage(R"(<client name="eye" x="3.5m" y="3.25m" theta="180deg"/>)");
    Simulation s(stage, 0), eye(stage, 2);
    SimCamera camera("camera", {test::small_rig(), {}, {5, 1}, background}, eye, clock);
    REQUIRE(camera.open().has_value());
    REQUIRE(camera.start(epoch).has_value());
    ActionRun& actions = s.actions();
    actions.start(epoch);
    std::vector<std::vector<uint8_t>> images;
    camera.trigger(epoch + 200 * kMs);
    for (int64_t t = 0; t <= 1200 * kMs; t += 50 * kMs) {
      if (t == 0) actions.command(test::action_command(1, "take", "cup"), epoch);
      actions.advance(epoch + t);
      if (t % (200 * kMs) != 0 || t == 0) continue;
      while (background && !camera.idle()) std::this_thread::yield();
      test::GuardedImage left(camera.format()), right(camera.format());
      REQUIRE(camera.read(left.view(), right.view(), INT64_MAX).status == ReadStatus::ok);
      images.push_back(left.bytes);
      camera.trigger(epoch + t + 200 * kMs);
    }
    CHECK(s.position("cup", epoch + 599 * kMs) == Vec2(1.95, 3.25));
    CHECK(s.position("cup", epoch + 600 * kMs) == Vec2(1.5, 2.7));
    if (background) CHECK(camera.rendered_ahead() == images.size());
    CHECK(images[1] != images[2]);
    return images;
  };
  MonotonicClock real;
  // Nothing becomes due during the test: frames are drawn when the world has settled, and only then.
  const auto ahead = with_action(real, true, real.now_ns() + 3600 * kSecond);
  const auto in_read = with_action(VirtualClock(kEpoch), false, kEpoch);
  CHECK(ahead == in_read);
}

TEST_CASE("each state looks different, and a state that comes back looks as it did") {
  Simulation s(test::acting_stage(R"(<client name="eye" x="3.5m" y="3.25m" theta="180deg"/>
      <event at="1s" object="cup" attr="level" value="full"/><event at="2s" object="cup" attr="level" value="empty"/>
      <event at="3s" object="cup" to="away"/><event at="4s" object="cup" x="1.95m" y="3.25m"/>)"),
               2);
  VirtualClock clock(kEpoch);
  StereoRig rig = test::small_rig();
  rig.width = 320, rig.height = 240, rig.focal_px *= 2, rig.cu_px = 159.5, rig.cv_px = 119.5;
  SimCamera camera("camera", {rig, {0, 0}, {15, 1}, false}, s, clock);
  REQUIRE(camera.open().has_value());
  REQUIRE(camera.start(kEpoch).has_value());
  std::vector<std::vector<uint8_t>> images;
  for (int64_t k = 0; k < 5; ++k) images.push_back(exposure(camera, kEpoch + k * kSecond + kSecond / 2));
  CHECK(images[0] != images[1]);
  CHECK(images[0] == images[2]);
  CHECK(images[3] != images[0]);
  CHECK(images[3] != images[1]);
  CHECK(images[4] == images[0]);
}

TEST_CASE("a snapshot holds what may change and the other robots, and nothing else") {
  Simulation s(test::acting_stage(), 0);
  s.begin(kEpoch);
  Snapshot met = s.make_snapshot();
  s.look(kEpoch, met);
  CHECK(met.placed.size() == 3);  // the cup, the crate, the other robot; bottle and table stay, the door is open
  const auto plain = test::small_simulation();
  plain->begin(kEpoch);
  Snapshot nothing = plain->make_snapshot();
  plain->look(kEpoch, nothing);
  CHECK(nothing.placed.empty());
  CHECK(nothing.scene.quads.empty());
}
