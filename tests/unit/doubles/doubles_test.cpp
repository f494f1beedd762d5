// SPDX-License-Identifier: Apache-2.0
// Doubles on the robot of one simulated world, each with its real driver, in virtual time: what the drivers say is what
// the world is like.
#include <doctest/doctest.h>

#include "hal/base/can_base.hpp"
#include "hal/camera/v4l2_camera.hpp"
#include "hal/doubles/in_world.hpp"
#include "hal/gpio/gpio_lines.hpp"
#include "hal/head/can_head.hpp"
#include "hal/sim/lens.hpp"
#include "hal/sim/sensors.hpp"
#include "rt/msg/geometry.hpp"
#include "tests/conformance/stereo_camera.hpp"
#include "tests/nanoseconds.hpp"
#include "tests/unit/can/bench.hpp"
#include "tests/unit/sim/small_world.hpp"

using namespace takt;

namespace {

using test::kMs, test::kSecond;

std::unique_ptr<sim::Simulation> world_from(sim::World world, int64_t epoch_ns) {
  auto simulation = std::make_unique<sim::Simulation>(std::move(world), 0, 3);
  simulation->begin(epoch_ns);
  return simulation;
}

sim::World world_with_path() {
  sim::World world = test::small_world();
  world.clients[0].path = test::small_path();
  return world;
}

}  // namespace

TEST_CASE("doubles: the head that the driver turns is the world's") {
  const auto world = world_from(test::small_world(), test::kDeviceEpoch);
  test::CanBench<head::CanHead, head::HeadDouble> bench(head::CanHeadSettings{}, doubles::neck_in(*world));
  REQUIRE(bench.driver.open().has_value());
  REQUIRE(bench.driver.start(bench.now()).has_value());
  HeadReading reading;
  bool followed = false;
  const auto jobs = [&](int count, double pan_rad, double tilt_rad) {
    for (int k = 0; k < count; ++k) {
      bench.pace(bench.now() + test::kDevicePeriod);
      followed = bench.driver.command(pan_rad, tilt_rad, bench.now());
      reading = bench.driver.read(bench.now(), INT64_MAX);
      if (reading.status != ReadStatus::ok) continue;
      const HeadReading truth = world->head(reading.stamp_ns);
      CHECK(reading.pan_rad == doctest::Approx(truth.pan_rad).epsilon(0.001).scale(1));
      CHECK(reading.tilt_rad == doctest::Approx(truth.tilt_rad).epsilon(0.001).scale(1));
    }
  };
  jobs(150, 0.5, -0.2);
  CHECK(followed);
  CHECK(world->head(bench.now()).pan_rad == doctest::Approx(0.5).epsilon(1e-3));
  CHECK(world->head(bench.now()).tilt_rad == doctest::Approx(-0.2).epsilon(1e-3));
  jobs(10, -0.5, 0);
  bench.driver.stop();  // in the middle of a motion: it brakes, and stays
  bench.pace(bench.now() + kSecond);
  const double stays = world->head(bench.now()).pan_rad;
  CHECK(std::abs(stays) < 0.45);
  bench.pace(bench.now() + kSecond);
  CHECK(world->head(bench.now()).pan_rad == doctest::Approx(stays));
}

TEST_CASE("doubles: the base drives the world's path, and its driver counts the world's odometry") {
  const auto world = world_from(world_with_path(), test::kDeviceEpoch);
  test::CanBench<base::CanBase, base::BaseDouble> bench(base::CanBaseSettings{}, doubles::body_in(*world));
  REQUIRE(bench.driver.open().has_value());
  REQUIRE(bench.driver.start(bench.now()).has_value());
  sim::DriftingOdometry simulated(*world, {}, world->seed());
  std::optional<BaseReading> first, first_simulated;
  BaseReading last, last_simulated;
  for (int k = 0; k < 500; ++k) {
    bench.pace(bench.now() + test::kDevicePeriod);
    const BaseReading reading = bench.driver.read(bench.now(), INT64_MAX);
    if (reading.status != ReadStatus::ok) continue;
    last = reading;
    last_simulated = simulated.at(reading.stamp_ns);
    if (!first) first = last, first_simulated = last_simulated;
    CHECK(reading.speed_m_s == doctest::Approx(last_simulated.speed_m_s).epsilon(0.01).scale(1));
  }
  REQUIRE(first);
  const auto way = [](const BaseReading& from, const BaseReading& to) {
    return std::hypot(to.x_m - from.x_m, to.y_m - from.y_m);
  };
  const auto turn = [](const BaseReading& from, const BaseReading& to) {
    return std::remainder(to.theta_rad - from.theta_rad, 2 * std::numbers::pi);
  };
  CHECK(way(*first, last) > 0.5);
  CHECK(way(*first, last) == doctest::Approx(way(*first_simulated, last_simulated)).epsilon(0.002));
  CHECK(turn(*first, last) == doctest::Approx(turn(*first_simulated, last_simulated)).epsilon(0.002));
  CHECK(last.epoch == 0);
}

TEST_CASE("doubles: a base that obeys moves the robot of the world, and is told of walls") {
  const auto world = world_from(test::small_world(), test::kDeviceEpoch);
  test::CanBench<base::CanBase, base::BaseDouble> bench(base::CanBaseSettings{}, doubles::body_in(*world));
  REQUIRE(bench.driver.open().has_value());
  REQUIRE(bench.driver.start(bench.now()).has_value());
  BaseReading reading;
  const auto jobs = [&](int count, double speed_m_s) {
    for (int k = 0; k < count; ++k) {
      bench.pace(bench.now() + test::kDevicePeriod);
      bench.driver.command(speed_m_s, 0, bench.now());
      reading = bench.driver.read(bench.now(), INT64_MAX);
    }
  };
  const double began_m = world->robot(bench.now()).x_m;
  jobs(150, 0.5);
  const double moved_m = world->robot(bench.now()).x_m - began_m;
  CHECK(moved_m > 0.8);
  CHECK(reading.x_m == doctest::Approx(moved_m).epsilon(0.03));
  CHECK_FALSE(reading.blocked);
  jobs(200, 0.5);
  CHECK(reading.blocked);
  jobs(20, 0);
  const double stood_m = world->robot(bench.now()).x_m;
  bench.pace(bench.now() + kSecond);
  CHECK(world->robot(bench.now()).x_m == stood_m);
}

TEST_CASE("doubles: a scanner sees the world from where it is mounted") {
  const auto world = world_from(world_with_path(), kSecond);
  Transform mount;
  mount.y = 0.3;
  mount.z = 0.25;
  std::vector<float> seen(181), wanted(181);
  constexpr double kDegree = std::numbers::pi / 180;
  const int64_t at_ns = 5 * kSecond;
  doubles::ranges_in(*world, mount)({at_ns, -90 * kDegree, kDegree, 0.00666}, seen);
  sim::LaserModel model;
  model.max_range_m = 80;
  model.sigma_m = 0.005;
  model.sensor_in_robot = mount;
  sim::Snapshot met = world->make_snapshot();
  sim::scan(*world, model, at_ns, wanted, met);
  for (size_t i = 0; i < seen.size(); ++i) CHECK(seen[i] == doctest::Approx(wanted[i]));
}

TEST_CASE("doubles: a camera's pixels are the world's, through the mosaic and the driver's codec") {
  for (const bool colours : {true, false}) {
    VirtualClock clock(kSecond);
    const auto world = world_from(world_with_path(), kSecond);
    StereoRig rig = test::small_rig();
    v4l2::V4l2CameraSettings settings;
    settings.path = "the double's";
    settings.rig = rig;
    settings.layout.mosaic = colours ? v4l2::Mosaic::grbg : v4l2::Mosaic::none;
    v4l2::FrameLayout layout = settings.layout;
    layout.width = rig.width;
    layout.height = rig.height;
    layout.bytes_per_line = layout.row_bytes();
    v4l2::VideoDouble device(
        {static_cast<uint32_t>(rig.width), static_cast<uint32_t>(rig.height), v4l2::four_characters(layout.format),
         static_cast<uint32_t>(layout.bytes_per_line), static_cast<uint32_t>(layout.image_bytes())},
        doubles::frames_in(*world, rig, layout), clock);
    device.expose_at(kSecond - 25 * kMs);
    v4l2::V4l2Camera driver("camera", settings, device.device(), clock);
    REQUIRE(driver.open().has_value());
    REQUIRE(driver.start(clock.now_ns()).has_value());
    test::GuardedImage left(driver.format()), right(driver.format());
    clock.advance_to(kSecond + 100 * kMs);
    const StereoFrame frame = driver.read(left.view(), right.view(), clock.now_ns() + 10 * kMs);
    REQUIRE(frame.status == ReadStatus::ok);
    // The newest of the exposures at -25, 41.67 and 108.33 ms; stamps have microseconds.
    CHECK(frame.stamp_ns / 1000 == (kSecond + 41'666'666) / 1000);

    const int64_t at_ns = Rate{15, 1}.release_ns(kSecond - 25 * kMs, 1);
    std::vector<uint8_t> drawn_left, drawn_right, bytes(layout.image_bytes());
    doubles::frames_in(*world, rig, layout)(0, at_ns, bytes);
    std::vector<uint8_t> plane(static_cast<size_t>(rig.width * rig.height)), other(plane), bgr(plane.size() * 3);
    v4l2::split(bytes, layout, {plane.data(), rig.width, rig.height}, {other.data(), rig.width, rig.height});
    if (colours)
      v4l2::debayer({plane.data(), rig.width, rig.height}, layout.mosaic, {bgr.data(), rig.width, rig.height, 3});
    const std::vector<uint8_t>& wanted = colours ? bgr : plane;
    const size_t row_bytes = wanted.size() / static_cast<size_t>(rig.height);
    size_t wrong = 0;
    for (int y = 0; y < rig.height; ++y)
      for (size_t i = 0; i < row_bytes; ++i)
        wrong += left.view().row(y)[i] != wanted[static_cast<size_t>(y) * row_bytes + i];
    CHECK(wrong == 0);

    // And these are what the simulated camera's lens draws, but for what the mosaic leaves out.
    rig.channels = colours ? 3 : 1;
    sim::Lens lens(rig);
    std::vector<uint8_t> drawn(wanted.size());
    lens.render(world->scene(), world->camera_pose(rig, 0, at_ns), {0, 0}, 0,
                {drawn.data(), rig.width, rig.height, rig.channels});
    double apart = 0;
    for (size_t i = 0; i < drawn.size(); ++i) apart += std::abs(drawn[i] - wanted[i]);
    CHECK(apart / static_cast<double>(drawn.size()) < (colours ? 8 : 2));
  }
}

TEST_CASE("doubles: lines follow the world's pulses once its time has begun") {
  sim::World small = test::small_world();
  small.lines.push_back({});
  small.lines[0].index = 0;
  small.lines[0].rest = true;
  small.lines[0].pulses.push_back({1.0, 1.5});
  sim::Simulation world(std::move(small), 0, 3);
  VirtualClock clock(kSecond);
  gpio::ChipDouble chip({"line0"}, clock, doubles::levels_in(world));
  gpio::GpioLines driver("lines", {.chip = "the double's", .inputs = {"0"}}, chip.chip(), clock);
  REQUIRE(driver.open().has_value());
  world.begin(clock.now_ns());
  REQUIRE(driver.start(clock.now_ns()).has_value());
  const auto level_at = [&](int64_t after_ns) {
    clock.advance_to(kSecond + after_ns);
    return driver.read(clock.now_ns()).levels;
  };
  CHECK(level_at(900 * kMs) == 1);
  CHECK(level_at(1100 * kMs) == 0);
  CHECK(level_at(1600 * kMs) == 1);
}
