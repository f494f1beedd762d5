// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <thread>

#include "hal/sim/sim_camera.hpp"
#include "hal/sim/sim_devices.hpp"
#include "tests/conformance/stereo_camera.hpp"
#include "tests/unit/sim/small_world.hpp"

using namespace takt;
using namespace takt::sim;
using test::path_world;

namespace {

constexpr int64_t kHour = 3'600'000'000'000;

/// `after_ns` after the epoch.
std::vector<uint8_t> exposure(Simulation& s, const Clock& clock, int64_t epoch_ns, int64_t after_ns, bool background) {
  SimCamera camera("camera", {test::small_rig(), {}, {15, 1}, background}, s, clock);
  REQUIRE(camera.open().has_value());
  REQUIRE(camera.start(epoch_ns).has_value());
  return test::exposure(camera, epoch_ns + after_ns);
}

}  // namespace

TEST_CASE("what the camera sees depends on seed and exposure only, not on the thread that rendered it") {
  MonotonicClock real;
  VirtualClock virtual_clock;
  const int64_t epoch = real.now_ns() + kHour;
  Simulation a(path_world(), 0, 11), b(path_world(), 0, 11), c(path_world(), 0, 12);
  const auto ahead = exposure(a, real, epoch, 900'000'000, true);
  const auto in_read = exposure(b, virtual_clock, epoch, 900'000'000, false);
  CHECK(ahead == in_read);
  CHECK(exposure(a, virtual_clock, epoch, 900'000'001, false) != in_read);  // other noise
  CHECK(exposure(c, virtual_clock, epoch, 900'000'000, false) != in_read);
}

TEST_CASE("a frame rendered in the background is used, and is the same") {
  MonotonicClock clock;
  const int64_t epoch = clock.now_ns() + kHour;
  Simulation s(path_world(), 0, 11);
  SimCamera camera("camera", {test::small_rig(), {}, {15, 1}, true}, s, clock);
  REQUIRE(camera.open().has_value());
  REQUIRE(camera.start(epoch).has_value());
  test::GuardedImage left(camera.format()), right(camera.format()), left_again(camera.format()),
      right_again(camera.format());
  const int64_t cpu = simulator_cost().ahead_ns;
  camera.trigger(epoch + 500'000'000);
  while (!camera.idle()) std::this_thread::yield();
  REQUIRE(camera.read(left.view(), right.view(), INT64_MAX).status == ReadStatus::ok);
  CHECK(camera.rendered_ahead() == 1);
  CHECK(simulator_cost().ahead_ns > cpu);
  camera.stop();
  SimCamera plain("camera", {test::small_rig(), {}, {15, 1}, false}, s, clock);
  REQUIRE(plain.open().has_value());
  REQUIRE(plain.start(epoch).has_value());
  plain.trigger(epoch + 500'000'000);
  REQUIRE(plain.read(left_again.view(), right_again.view(), INT64_MAX).status == ReadStatus::ok);
  CHECK(left.bytes == left_again.bytes);
  CHECK(right.bytes == right_again.bytes);
}

TEST_CASE("a camera started in the midst of a run gives nothing that was not asked for in time") {
  MonotonicClock clock;
  Simulation s(path_world(), 0, 11);
  SimCamera camera("camera", {test::small_rig(), {}, {5, 1}, true}, s, clock);
  REQUIRE(camera.open().has_value());
  const int64_t now = clock.now_ns();
  REQUIRE(camera.start(now - kHour).has_value());
  test::GuardedImage left(camera.format()), right(camera.format());
  const auto read = [&] { return camera.read(left.view(), right.view(), INT64_MAX); };
  camera.trigger(now - 1'000'000);
  CHECK(read().status == ReadStatus::no_data);
  const int64_t ahead = clock.now_ns() + kHour;
  camera.trigger(ahead);
  while (!camera.idle()) std::this_thread::yield();
  const StereoFrame first = read();
  CHECK(first.status == ReadStatus::ok);
  CHECK(first.stamp_ns == ahead);
  CHECK(first.frame_number == 1);
  CHECK(camera.cost().in_read_ns == 0);
  camera.trigger(clock.now_ns());  // once it has started, none is refused
  CHECK(read().status == ReadStatus::ok);
}

TEST_CASE("a base started in the midst of a run says what one says that was there from the start") {
  VirtualClock clock(kHour);
  Simulation s(path_world(), 0, 5);
  SimBase always("base", {}, s), late("base", {}, s, &clock);
  REQUIRE(always.start(0).has_value());
  REQUIRE(late.start(0).has_value());
  const BaseReading expected = always.read(kHour + 20'000'000, INT64_MAX),
                    reading = late.read(kHour + 20'000'000, INT64_MAX);
  CHECK(reading.x_m == expected.x_m);
  CHECK(reading.y_m == expected.y_m);
  CHECK(reading.theta_rad == expected.theta_rad);
}

TEST_CASE("odometry drifts, but within what its model allows") {
  Simulation s(path_world(), 0, 5);
  s.begin(0);
  DriftingOdometry drifting(s, {}, 5), exact(s, {0, 0, 0, 0}, 5);
  const RobotState start = s.robot(0);
  double travelled = 0;
  RobotState previous = start;
  for (int64_t t = 0; t <= 60'000'000'000; t += 50'000'000) {
    const RobotState truth = s.robot(t);
    travelled += std::hypot(truth.x_m - previous.x_m, truth.y_m - previous.y_m);
    previous = truth;
    const double c = std::cos(start.theta_rad), n = std::sin(start.theta_rad);
    const double tx = c * (truth.x_m - start.x_m) + n * (truth.y_m - start.y_m),
                 ty = -n * (truth.x_m - start.x_m) + c * (truth.y_m - start.y_m);
    const BaseReading e = exact.at(t);
    CHECK(std::hypot(e.x_m - tx, e.y_m - ty) < 0.002 + 1e-3 * travelled);
    CHECK(std::abs(std::remainder(e.theta_rad - truth.theta_rad + start.theta_rad, 6.283185307179586)) < 1e-6);
    const BaseReading d = drifting.at(t);
    CHECK(std::hypot(d.x_m - tx, d.y_m - ty) < 0.01 + 0.2 * travelled);
  }
  CHECK(travelled > 15.0);
  const BaseReading end = drifting.at(60'000'000'000), ideal = exact.at(60'000'000'000);
  CHECK(std::hypot(end.x_m - ideal.x_m, end.y_m - ideal.y_m) > 0.01);
  // Pure function of the instant: asking for an earlier one and coming back gives the same.
  (void)drifting.at(1'000'000'000);
  CHECK(drifting.at(60'000'000'000).x_m == end.x_m);
}

TEST_CASE("the base refuses to drive into a wall and can turn away from it") {
  const auto s = test::small_simulation();
  SimBase base("base", {}, *s);
  REQUIRE(base.open().has_value());
  REQUIRE(base.start(0).has_value());
  bool blocked = false;
  int64_t t = 0;
  for (; t < 12'000'000'000; t += 20'000'000) {
    base.command(-1.0, 0.0, t);  // backwards, the wall is 1.4 m behind
    blocked |= base.read(t, INT64_MAX).blocked;
    const RobotState r = s->robot(t);
    CHECK_FALSE(collides(s->world(), Vec2(r.x_m, r.y_m), Simulation::kFootprintRadius - 0.02));
  }
  CHECK(blocked);
  CHECK(std::abs(s->robot(t).speed_m_s) < 0.02);
  const double heading = s->robot(t).theta_rad;
  for (const int64_t end = t + 3'000'000'000; t < end; t += 20'000'000) {
    base.command(0.3, 0.5, t);
    (void)base.read(t, INT64_MAX);
  }
  CHECK(s->robot(t).theta_rad > heading + 0.5);
  CHECK(s->robot(t).x_m > 0.7);
}

TEST_CASE("a pulse of a digital line between two reads is not lost") {
  World world = test::small_world();
  world.lines.push_back({0, "emergency_stop", true, {{0.050, 0.060}}});
  Simulation s(std::move(world), 0, 1);
  SimLines lines("lines", s);
  REQUIRE(lines.open().has_value());
  REQUIRE(lines.start(0).has_value());
  CHECK(lines.read(0).levels == 1);
  const LinesReading after = lines.read(100'000'000);
  CHECK(after.levels == 1);
  CHECK(after.changed == 1);
}

TEST_CASE("a world that nobody moves stands still however long nobody looks, and then obeys") {
  const auto s = test::small_simulation();
  s->set_drive(Drive::command);
  s->begin(0);
  const RobotState start = s->robot(0);
  constexpr int64_t kHour = 3'600'000'000'000;
  s->advance_base(kHour);
  s->advance_head(kHour);
  for (const int64_t at : {int64_t{0}, kHour - 1'000'000'000, kHour}) {
    CHECK(s->robot(at).x_m == start.x_m);
    CHECK(s->robot(at).theta_rad == start.theta_rad);
    CHECK(s->head(at).pan_rad == 0);
  }
  CHECK(s->settled(true, kHour));
  s->command_base(0, 0.5, kHour);
  s->command_head(0.3, 0, kHour);
  s->advance_base(kHour + 1'000'000'000);
  s->advance_head(kHour + 1'000'000'000);
  CHECK(s->robot(kHour + 300'000'000).theta_rad > start.theta_rad);
  CHECK(s->head(kHour + 1'000'000'000).pan_rad > 0.1);
}
