// SPDX-License-Identifier: Apache-2.0
// The driver of the mobile base against its double, byte by byte through a socket, in virtual time.
#include "hal/base/can_base.hpp"

#include <doctest/doctest.h>

#include <string_view>

#include "hal/base/base_double.hpp"
#include "tests/conformance/dbc_file.hpp"
#include "tests/nanoseconds.hpp"
#include "tests/unit/can/bench.hpp"

using namespace takt;
using namespace takt::base;

namespace {

using test::kMs;

struct Bench : test::CanBench<CanBase, BaseDouble> {
  BaseReading reading;
  bool followed = false;

  Bench() : CanBench(CanBaseSettings{}) {}
  /// Jobs of a node every 20 ms: a disconnected device is restarted. NaN: no command.
  void jobs(int count, double speed_m_s = std::nan(""), double turn_rad_s = 0) {
    for (int k = 0; k < count; ++k) {
      pace(now() + test::kDevicePeriod);
      if (reading.status == ReadStatus::disconnected && !driver.restart(now())) continue;
      if (!std::isnan(speed_m_s)) followed = driver.command(speed_m_s, turn_rad_s, now());
      reading = driver.read(now(), INT64_MAX);
    }
  }
  void start() {
    REQUIRE(driver.open().has_value());
    REQUIRE(driver.start(now()).has_value());
    jobs(20);
    REQUIRE(reading.status == ReadStatus::ok);
  }
};

}  // namespace

TEST_CASE("can base: the table is that of the DBC file") {
  test::check_table(messages(), std::filesystem::path(TAKT_SOURCE_DIR) / "hal/base/ace_base.dbc");
}

TEST_CASE("can base: a frame of each kind, byte by byte") {
  const auto made = [](size_t message, std::span<const double> values, uint8_t counter) {
    can::Frame frame = can::encode(messages()[message], values);
    can::EndToEndSender(counter).protect(messages()[message], frame);
    return frame.data;
  };
  // The CRCs were computed apart from this code, by the few lines of golden/verify_golden.py.
  CHECK(made(kWheels, std::array{2.0, 16777215.0, 66051.0}, 3) ==
        std::array<uint8_t, 8>{0xC1, 0x23, 0xFF, 0xFF, 0xFF, 0x03, 0x02, 0x01});
  CHECK(made(kMotion, std::array{1.0, 0.0, 1.0, 0.0, -0.5, 0.25, 1234.5}, 4) ==
        std::array<uint8_t, 8>{0xC7, 0x54, 0x78, 0xEC, 0xC4, 0x09, 0x39, 0x30});
  CHECK(made(kCommand, std::array{1.0, 1.4, -1.2, 1.35}, 14) ==
        std::array<uint8_t, 8>{0x36, 0x1E, 0xB0, 0x36, 0x20, 0xD1, 0x87, 0x00});
}

TEST_CASE("can base: it drives a square, and its pose closes although the counters wrapped") {
  Bench bench;
  bench.start();
  for (int side = 0; side < 4; ++side) {
    bench.jobs(200, 0.5);
    CHECK(bench.followed);
    bench.jobs(60, 0.0);
    CHECK(std::abs(bench.reading.speed_m_s) < 1e-3);
    // A quarter turn: accelerating and braking at 2.5 rad/s^2 cancel, so that it lasts angle / rate.
    const double before = bench.reading.theta_rad;
    bench.jobs(100, 0.0, std::numbers::pi / 4);
    bench.jobs(60, 0.0);
    CHECK(std::abs(wrapped(bench.reading.theta_rad - before - std::numbers::pi / 2)) < 0.02);
  }
  CHECK(bench.reading.epoch == 0);
  CHECK(std::hypot(bench.reading.x_m, bench.reading.y_m) < 0.1);
  CHECK(bench.driver.station().counters().damaged == 0);
}

TEST_CASE("can base: each misbehaviour is told, the base stops by itself, and it works again when it ends") {
  struct Case {
    Misbehaviour how;
    ReadStatus status;
  };
  for (const Case& c :
       {Case{Misbehaviour::silent, ReadStatus::no_data}, Case{Misbehaviour::unplugged, ReadStatus::disconnected},
        Case{Misbehaviour::wrong_crc, ReadStatus::partial}, Case{Misbehaviour::lost_frames, ReadStatus::no_data},
        Case{Misbehaviour::repeated, ReadStatus::no_data}, Case{Misbehaviour::garbage, ReadStatus::partial},
        Case{Misbehaviour::no_heartbeat, ReadStatus::no_data}, Case{Misbehaviour::bus_off, ReadStatus::disconnected}}) {
    CAPTURE(static_cast<int>(c.how));
    Bench bench;
    bench.start();
    bench.jobs(50, 0.4);
    bench.device.misbehave(c.how);
    bench.jobs(40);  // nobody commands any more
    CHECK(bench.reading.status == c.status);
    CHECK(bench.device.speed_m_s() == 0);
    bench.device.misbehave(Misbehaviour::none);
    bench.jobs(100, 0.3);
    CHECK(bench.reading.status == ReadStatus::ok);
    CHECK(bench.followed);
    CHECK(bench.reading.speed_m_s == doctest::Approx(0.3).epsilon(1e-3));
  }
}

TEST_CASE("can base: wheels that stand while it has to move, or says that it does, count as frozen") {
  Bench bench;
  bench.start();
  bench.jobs(50, 0.4);
  CHECK_FALSE(bench.reading.repeated);
  bench.device.misbehave(Misbehaviour::frozen);
  bench.jobs(20, 0.4);
  CHECK_FALSE(bench.reading.repeated);  // not for long enough
  bench.jobs(20, 0.4);
  CHECK(bench.reading.status == ReadStatus::ok);
  CHECK(bench.reading.repeated);
  CHECK(std::string_view(bench.driver.trouble()).find("wheels stand") != std::string_view::npos);
  bench.device.misbehave(Misbehaviour::none);
  bench.jobs(50, 0.4);
  CHECK_FALSE(bench.reading.repeated);
  CHECK(std::string_view(bench.driver.trouble()).empty());

  Bench standing;
  standing.start();
  standing.device.misbehave(Misbehaviour::frozen);
  standing.jobs(50, 0);
  CHECK_FALSE(standing.reading.repeated);
  standing.jobs(50, 0, 0.5);
  CHECK(standing.reading.repeated);
}

TEST_CASE("can base: emergency stop and bumper are refusals; a fault is reset by a restart") {
  Bench bench;
  bench.start();
  bench.jobs(50, 0.4);
  for (const bool stop : {true, false}) {
    stop ? bench.device.press_emergency_stop(true) : bench.device.hit_bumper(true);
    bench.jobs(30, 0.4);
    CHECK(bench.reading.status == ReadStatus::ok);
    CHECK(bench.reading.blocked);
    CHECK_FALSE(bench.followed);
    CHECK(bench.reading.speed_m_s == 0);
    stop ? bench.device.press_emergency_stop(false) : bench.device.hit_bumper(false);
    bench.jobs(30, 0.4);
    CHECK_FALSE(bench.reading.blocked);
    CHECK(bench.followed);
  }
  bench.device.fail();
  bench.jobs(1);
  CHECK(bench.reading.status == ReadStatus::disconnected);
  CHECK_FALSE(bench.driver.restart(bench.now()));
  bench.jobs(20, 0.4);
  CHECK(bench.followed);
}

TEST_CASE("can base: one that booted keeps its pose and raises its epoch") {
  Bench bench;
  bench.start();
  bench.jobs(150, 0.5);
  bench.jobs(50, 0.0);
  const BaseReading before = bench.reading;
  CHECK(before.x_m > 1);
  bench.device.reboot();
  bench.jobs(30);
  CHECK(bench.reading.status == ReadStatus::ok);
  CHECK(bench.reading.epoch == before.epoch + 1);
  CHECK(bench.reading.x_m == before.x_m);
  CHECK(bench.reading.theta_rad == before.theta_rad);
}

TEST_CASE("wheel odometry: straight, on the spot, over the wrap; jumps start anew") {
  constexpr uint32_t kCounts = 1000;
  const WheelGeometry geometry{0.01, 0.5};
  const auto after = [&](std::initializer_list<std::pair<uint32_t, uint32_t>> counts, int64_t step_ns = 100 * kMs) {
    WheelOdometry odometry(geometry, kCounts, 2.0);
    int64_t at_ns = 0;
    for (const auto& [left, right] : counts) odometry.observe(left, right, at_ns += step_ns);
    return odometry;
  };
  CHECK(after({{5, 7}}).pose().x_m == 0);
  CHECK(after({{5, 7}}).epoch() == 0);
  CHECK(after({{0, 0}, {10, 10}, {20, 20}}).pose().x_m == doctest::Approx(0.2));
  CHECK(after({{990, 995}, {0, 5}}).pose().x_m == doctest::Approx(0.1));
  CHECK(after({{0, 5}, {990, 995}}).pose().x_m == doctest::Approx(-0.1));
  const auto turned = after({{0, 0}, {990, 10}}).pose();
  CHECK(turned.x_m == doctest::Approx(0));
  CHECK(turned.theta_rad == doctest::Approx(0.2 / 0.5));
  // A half circle of radius 1 m: outer wheel 1.25 pi, inner 0.75 pi, in one look.
  const auto half = after({{0, 0}, {236, 393}}, 10'000 * kMs).pose();
  CHECK(half.x_m == doctest::Approx(0).epsilon(0.02));
  CHECK(half.y_m == doctest::Approx(2.0).epsilon(0.01));
  const auto jumped = after({{0, 0}, {10, 10}, {500, 500}, {510, 510}});
  CHECK(jumped.epoch() == 1);
  CHECK(jumped.pose().x_m == doctest::Approx(0.2));
  auto forgotten = after({{0, 0}, {10, 10}});
  forgotten.forget();
  CHECK_FALSE(forgotten.observe(12, 12, 300 * kMs));
  CHECK(forgotten.epoch() == 1);
  CHECK(forgotten.pose().x_m == doctest::Approx(0.1));
}
