// SPDX-License-Identifier: Apache-2.0
// Laser scanner and base of a recorded drive.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "hal/replay/replay_base.hpp"
#include "hal/replay/replay_laser.hpp"
#include "rt/msg/geometry.hpp"
#include "tests/conformance/devices.hpp"
#include "tests/has.hpp"
#include "tests/unit/replay/carmen_file.hpp"

using namespace takt;
using namespace takt::replay;
using namespace takt::test;

namespace {

constexpr int64_t kSecond = 1'000'000'000;

/// Two seconds on an arc, from rest to 0.4 m/s and 0.2 rad/s: odometry every 10 ms, a scan every 20 ms.
std::string drive(bool raw) {
  std::string text;
  PlanarPose pose;
  for (int k = 0; k <= 200; ++k) {
    const double t = 0.01 * k, speed = std::min(0.4, 0.5 * t);
    text += odom_line(t, pose);
    if (k % 2 == 0) text += raw ? rawlaser_line(t, 5, 1 + t) : flaser_line(t, 181, 1 + t, pose);
    pose = compose(pose, {0.01 * speed, 0, 0.005 * speed});
  }
  return text;
}
LogPace pace(double speed, double start_s) { return {speed, std::llround(start_s * 1e9)}; }

std::string laser_error(const CarmenFile& file, LogPace pace = {}) {
  const auto opened = ReplayLaser("laser", {file.path, pace, {}, 0}).open();
  return opened ? "" : opened.error().text();
}
std::string base_error(const CarmenFile& file, LogPace pace = {}) {
  const auto opened = ReplayBase("base", {file.path, pace}).open();
  return opened ? "" : opened.error().text();
}

}  // namespace

TEST_CASE("replayed laser and base conform") {
  for (const bool raw : {false, true}) {
    const CarmenFile file(drive(raw));
    ReplayLaser laser("laser", {file.path, {}, {}, 0});
    check_laser_scanner(laser);
    ReplayBase base("base", {file.path, {}});
    check_mobile_base(base, false);
    CHECK(base.limits().speed_m_s == doctest::Approx(0.4));
    CHECK(base.limits().turn_rad_s == doctest::Approx(0.2));
    // A speed is a mean over 0.25 s: it rises by 0.5 m/s^2 from then on, and faster before.
    CHECK(base.limits().acceleration_m_s2 >= 0.49);
  }
}

TEST_CASE("the rate of a replayed laser is that of the run, not of the log") {
  std::string text;
  for (const double t : {1.0, 1.1, 1.2, 2.0}) text += flaser_line(t, 4, t);
  const CarmenFile file(text + odom_line(3, {}));
  ReplayLaser laser("laser", {file.path, pace(10, 0), {}, 0});
  REQUIRE(laser.open().has_value());
  CHECK(laser.format().rate_hz == doctest::Approx(30));
}

TEST_CASE("a read gives the newest scan that was not delivered, with its recorded stamp; then the data end") {
  std::string text;
  for (const double t : {1.0, 1.1, 1.2, 2.0}) text += flaser_line(t, 4, t);
  const CarmenFile file(text + odom_line(3, {}));
  ReplayLaser laser("laser", {file.path, {}, {}, 1.13});
  REQUIRE(laser.open().has_value());
  REQUIRE(laser.open().has_value());
  CHECK(laser.scans() == 4);
  CHECK(laser.format().rate_hz == doctest::Approx(3));
  CHECK(laser.format().max_range_m == 1.13);
  for (const int64_t epoch : {int64_t{0}, 5 * kSecond + 7}) {
    REQUIRE(laser.start(epoch).has_value());
    std::vector<float> range(4, -1.0f);
    const auto read = [&](double t) { return laser.read(range, epoch + std::llround(t * 1e9), INT64_MAX); };
    CHECK(read(0.5).status == ReadStatus::no_data);
    CHECK(range[0] == -1.0f);
    ScanReading reading = read(1.0);
    CHECK(reading.status == ReadStatus::ok);
    CHECK(reading.stamp_ns == epoch + kSecond);
    CHECK(range[0] == 1.0f);
    reading = read(1.5);  // the scan at 1.1 s was overtaken
    CHECK(reading.status == ReadStatus::ok);
    CHECK(reading.stamp_ns == epoch + 1'200'000'000);
    CHECK(reading.scan_number == 2);
    CHECK(range[0] == 0.0f);  // 1.2 m is more than the largest range
    CHECK(read(1.6).status == ReadStatus::no_data);
    reading = laser.read(std::span(range).first(2), epoch + 2 * kSecond, INT64_MAX);
    CHECK(reading.status == ReadStatus::partial);
    CHECK(reading.scan_number == 3);
    CHECK(read(2.5).status == ReadStatus::no_data);  // the log goes on, with odometry
    CHECK(read(3.0).status == ReadStatus::no_data);
    CHECK(read(3.001).status == ReadStatus::end_of_data);
    CHECK(read(2.0).status == ReadStatus::end_of_data);
    laser.stop();
  }
  laser.close();
  CHECK_FALSE(laser.start(0).has_value());
}

TEST_CASE("odometry: the newest line, again if there is none newer; speeds by difference, sign included") {
  const CarmenFile file(odom_line(1.0, {0, 0, 3.1}) + odom_line(1.2, {0, 0, 3.1}) + odom_line(1.5, {0.3, 0, -3.1}) +
                        odom_line(2.0, {0.3, 0, -3.1}) + flaser_line(2.5, 4, 1));
  ReplayBase base("base", {file.path, {}});
  REQUIRE(base.open().has_value());
  REQUIRE(base.start(10 * kSecond).has_value());
  const auto read = [&](double t) { return base.read(10 * kSecond + std::llround(t * 1e9), INT64_MAX); };
  CHECK(read(0.9).status == ReadStatus::no_data);
  CHECK(read(1.3).status == ReadStatus::ok);
  const BaseReading moving = read(1.6);
  CHECK(moving.stamp_ns == 11'500'000'000);
  CHECK(moving.x_m == 0.3);
  // Since 1.2 s: 0.3 m along x, nearly backwards, while it turned left through the back.
  CHECK(moving.turn_rad_s == doctest::Approx((2 * 3.14159265358979 - 6.2) / 0.3));
  const double half = moving.turn_rad_s * 0.3 / 2;
  CHECK(moving.speed_m_s == doctest::Approx(-half / std::sin(half)));  // an arc over a chord of 0.3 m
  CHECK(base.limits().speed_m_s == -moving.speed_m_s);
  const BaseReading again = read(1.7);
  CHECK(again.status == ReadStatus::ok);
  CHECK(again.stamp_ns == moving.stamp_ns);
  CHECK(base.read(12 * kSecond, 12 * kSecond - 1).status == ReadStatus::no_data);
  CHECK(read(2.5).speed_m_s == 0.0);
  CHECK(read(2.501).status == ReadStatus::end_of_data);
  CHECK(read(2.502).status == ReadStatus::end_of_data);
  CHECK_FALSE(base.command(0.1, 0, 0));
}

TEST_CASE("the last scan and the last line are delivered even to one who comes late") {
  const CarmenFile file(drive(false));
  ReplayLaser laser("laser", {file.path, {}, {}, 0});
  ReplayBase base("base", {file.path, {}});
  REQUIRE(laser.open().has_value());
  REQUIRE(base.open().has_value());
  REQUIRE(laser.start(0).has_value());
  REQUIRE(base.start(0).has_value());
  std::vector<float> range(181);
  CHECK(laser.read(range, 100 * kSecond, INT64_MAX).scan_number == 100);
  CHECK(laser.read(range, 101 * kSecond, INT64_MAX).status == ReadStatus::end_of_data);
  CHECK(base.read(100 * kSecond, INT64_MAX).stamp_ns == 2 * kSecond);
  CHECK(base.read(101 * kSecond, INT64_MAX).status == ReadStatus::end_of_data);
}

TEST_CASE("speed and start: stamps and speeds are in the time of the run") {
  const CarmenFile file(drive(false));
  ReplayLaser laser("laser", {file.path, pace(2, 1.5), {}, 0});
  ReplayBase base("base", {file.path, pace(2, 1.5)});
  REQUIRE(laser.open().has_value());
  REQUIRE(base.open().has_value());
  REQUIRE(laser.start(kSecond).has_value());
  REQUIRE(base.start(kSecond).has_value());
  std::vector<float> range(181);
  const ScanReading first = laser.read(range, kSecond, INT64_MAX), next = laser.read(range, 1'010'000'000, INT64_MAX);
  CHECK(first.stamp_ns == kSecond);
  CHECK(first.scan_number == 0);
  CHECK(range[0] == 2.52f);
  CHECK(next.stamp_ns == 1'010'000'000);
  CHECK(laser.scans() == 26);
  CHECK(base.read(1'200'000'000, INT64_MAX).speed_m_s == doctest::Approx(0.8));
  CHECK(base.read(1'250'000'000, INT64_MAX).status == ReadStatus::ok);
  CHECK(base.read(1'250'000'001, INT64_MAX).status == ReadStatus::end_of_data);
}

TEST_CASE("the laser stands where the log says, unless the graph says otherwise") {
  const CarmenFile file("PARAM robot_frontlaser_offset 0.3 nohost 0\n" + drive(false));
  ReplayLaser by_log("laser", {file.path, {}, {}, 0});
  REQUIRE(by_log.open().has_value());
  CHECK(by_log.format().sensor_in_robot.y == 0.3);
  Transform mount;
  mount.y = 0.1;
  ReplayLaser by_graph("laser", {file.path, {}, mount, 0});
  REQUIRE(by_graph.open().has_value());
  CHECK(by_graph.format().sensor_in_robot.y == 0.1);
}

TEST_CASE("logs that give nothing are refused before the start") {
  const CarmenFile drive_only(odom_line(1, {})), scans_only(flaser_line(1, 4, 1)), late(flaser_line(1e9, 4, 1));
  CHECK(has(laser_error(drive_only), "holds no scan"));
  CHECK(has(base_error(scans_only), "holds no ODOM line"));
  CHECK(has(laser_error(scans_only, pace(1, 1.5)), "no scan at or after 1.5"));
  CHECK(has(laser_error(scans_only, pace(0, 0)), "`speed` is 0"));
  CHECK(has(laser_error(scans_only, pace(std::nan(""), 0)), "`speed` is"));
  CHECK(has(laser_error(late), "`start: 1000000000.0"));
  CHECK(laser_error(late, pace(1, 1e9)) == "");
  const CarmenFile minutes(flaser_line(1000.5, 4, 1));
  CHECK(has(laser_error(minutes), "add `start: 1000.5"));
  CHECK(laser_error(minutes, pace(200, 0)) == "");
  CHECK(laser_error(scans_only, pace(1, -5)) == "");
}
