// SPDX-License-Identifier: Apache-2.0
#include "hal/replay/carmen_log.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hal/replay/late_stamps.hpp"
#include "tests/has.hpp"
#include "tests/unit/replay/carmen_file.hpp"

using namespace takt;
using namespace takt::replay;
using namespace takt::test;

namespace {

CarmenLog loaded(const std::string& text) {
  const CarmenFile file(text);
  auto log = load_carmen_log("laser", file.path);
  REQUIRE_MESSAGE(log.has_value(), (log ? "" : log.error().text()));
  return std::move(*log);
}

/// What is wrong with a log, without the name of its file.
std::string error(const std::string& text) {
  const CarmenFile file(text);
  const auto log = load_carmen_log("laser", file.path);
  if (log) return "";
  CHECK(log.error().id == "laser");
  CHECK(log.error().bad_input);
  CHECK_FALSE(log.error().fix.empty());
  std::string what = log.error().what;
  const size_t at = what.find(file.path.string());
  REQUIRE(at == 0);
  return what.substr(file.path.string().size());
}

constexpr double kDegree = std::numbers::pi / 180;

}  // namespace

TEST_CASE("poses: between undoes compose, and the heading stays within half a turn") {
  const PlanarPose a{1, 2, 3}, b{-0.5, 0.25, 2};
  const PlanarPose back = between(a, compose(a, b));
  CHECK(back.x_m == doctest::Approx(b.x_m));
  CHECK(back.y_m == doctest::Approx(b.y_m));
  CHECK(back.theta_rad == doctest::Approx(b.theta_rad));
  CHECK(compose(a, b).theta_rad == doctest::Approx(5 - 2 * std::numbers::pi));
  const PlanarPose ahead = compose({1, 1, std::numbers::pi / 2}, {2, 0, 0});
  CHECK(ahead.x_m == doctest::Approx(1));
  CHECK(ahead.y_m == doctest::Approx(3));
}

TEST_CASE("FLASER: geometry from the number of beams, ranges as they are, odometry of the line before") {
  const CarmenLog log = loaded("# a comment\nPARAM robot_frontlaser_offset -0.04 nohost 0\nSYNC here 0 host 0\n" +
                               odom_line(0.9, {1, 2, 0.5}) + flaser_line(1.0, 181, 0.5, {7, 8, 0.1}) + "\n" +
                               odom_line(1.1, {2, 2, 0.5}) + flaser_line(1.25, 181, 1.5));
  CHECK(log.beams == 181);
  CHECK(log.first_angle_rad == doctest::Approx(-90 * kDegree));
  CHECK(log.step_rad == doctest::Approx(kDegree));
  CHECK(log.max_range_m == 80.0);
  CHECK(log.laser_ahead_m == -0.04);
  REQUIRE(log.scans.size() == 2);
  CHECK(log.scans[0].time_ns == 1'000'000'000);
  CHECK(log.scans[1].time_ns == 1'250'000'000);
  CHECK(log.end_ns == 1'250'000'000);
  CHECK(log.scans[0].odometry.x_m == 1);
  CHECK(log.scans[1].odometry.x_m == 2);
  CHECK(log.scans[0].logged.y_m == 8);
  CHECK(log.range_m[1] == 0.51f);
  CHECK(log.range_m[181 + 180] == doctest::Approx(3.3));
  REQUIRE(log.odometry.size() == 2);
  CHECK(log.odometry[1].time_ns == 1'100'000'000);
  CHECK(corrected_poses(log).empty());
  CHECK(log.late_stamps == 0);
  for (const auto& [beams, step] : {std::pair{180, 1.0}, std::pair{360, 0.5}, std::pair{361, 0.5}})
    CHECK(loaded(flaser_line(0, beams, 1)).step_rad == doctest::Approx(step * kDegree));
}

TEST_CASE("RAWLASER1 brings its geometry; the scan message that comes first counts") {
  const CarmenLog log =
      loaded("RAWLASER2 what ever\n" + rawlaser_line(1, 5, 0.5) + flaser_line(1, 181, 1) + rawlaser_line(2, 5, 1));
  CHECK(log.beams == 5);
  CHECK(log.first_angle_rad == -1.5);
  CHECK(log.step_rad == 0.02);
  CHECK(log.max_range_m == 25.5);
  CHECK(log.scans.size() == 2);
  CHECK(log.range_m[5] == 1.0f);
  CHECK(loaded(flaser_line(1, 9, 1) + rawlaser_line(1, 5, 0.5)).beams == 9);
}

TEST_CASE("a corrected log: the line with the corrected pose is no odometry, whatever its time") {
  for (const char* time : {"0", "1.17", "6.12103e-62", "4e-320", "nan"}) {
    const std::string meaningless = std::string(" 0 0 0 ") + time + " host " + time + "\n";
    const CarmenLog log =
        loaded(odom_line(1, {0, 0, 0}) + odom_line(2, {1, 0, 0}) + flaser_line(2, 4, 1, {1.5, 1, 0}) + "ODOM 1.5 1 0" +
               meaningless + "NEFF 15\n" + odom_line(3, {2.5, 1, 0}) +
               flaser_line(3, 4, 1, {2.5, 1.5, std::numbers::pi / 2}) + "ODOM 2.5 1.5 " + number(std::numbers::pi / 2) +
               meaningless + "NEFF 14\n" + odom_line(4, {2.5, 2.5, std::numbers::pi / 2}));
    REQUIRE(log.odometry.size() == 4);
    for (size_t i = 0; i < 4; ++i) {
      CHECK(log.odometry[i].time_ns == static_cast<int64_t>(i + 1) * 1'000'000'000);
      CHECK(log.odometry[i].pose.x_m == doctest::Approx(static_cast<double>(i)));
      CHECK(log.odometry[i].pose.y_m == doctest::Approx(0));
      CHECK(log.odometry[i].pose.theta_rad == doctest::Approx(0));
    }
    const auto truth = corrected_poses(log);
    REQUIRE(truth.size() == 2);
    CHECK(truth[0].time_ns == 2'000'000'000);
    CHECK(truth[1].pose.y_m == 1.5);
  }
  // Without NEFF the same line is what it says: the robot stands.
  CHECK(loaded(flaser_line(2, 4, 1, {1.5, 1, 0}) + odom_line(3, {1.5, 1, 0})).odometry.size() == 1);
}

TEST_CASE("late stamps: spread between those that can be trusted; an ODOM line and its scan stay together") {
  const CarmenLog log = loaded(odom_line(1, {}) + odom_line(1.9, {}) + odom_line(1.8, {}) + flaser_line(1.8, 4, 1) +
                               odom_line(1.6, {}) + odom_line(2, {}));
  REQUIRE(log.odometry.size() == 5);
  CHECK(log.late_stamps == 2);
  CHECK(log.odometry[1].time_ns == 1'200'000'000);
  CHECK(log.odometry[2].time_ns == 1'400'000'000);
  CHECK(log.scans[0].time_ns == 1'400'000'000);
  CHECK(log.odometry[3].time_ns == 1'600'000'000);
  CHECK(log.without_time == 0);
  const CarmenLog headless =
      loaded(flaser_line(1, 4, 9) + odom_line(1.5, {}) + odom_line(1, {}) + flaser_line(2, 4, 1));
  CHECK(headless.without_time == 2);
  REQUIRE(headless.scans.size() == 1);
  CHECK(headless.range_m.size() == 4);
  CHECK(headless.range_m[0] == 1.0f);
  CHECK(headless.odometry.size() == 1);
}

TEST_CASE("mistakes are told with file and line") {
  const std::string good = odom_line(1, {});
  CHECK(has(error(good + "ODOM 1 2\n"), ":2: ODOM has 3 words, needs 10"));
  CHECK(has(error(good + "ODOM 1 x 3 0 0 0 1 host 1\n"), ":2: word 3 of ODOM is `x`"));
  CHECK(has(error(good + "ODOM 1 nan 3 0 0 0 1 host 1\n"), ":2: word 3 of ODOM is `nan`"));
  CHECK(has(error(good + "ODOM 1 2 3 0 0 0 1 host soon\n" + good), ":2: ODOM ends with no time"));
  CHECK(has(error(good + "ODOM 1 2 3 0 0 0 1 host -1\n"), ":2: ODOM ends with no time"));
  CHECK(has(error(good + "FLASER\n"), ":2: FLASER has no count"));
  CHECK(has(error("FLASER 1 1 0 0 0 0 0 0 1 host 1\n"), ":1: word 2 of FLASER is 1, not a count from 2 to 4096"));
  CHECK(has(error("FLASER 1e9 1 0 0 0 0 0 0 1 host 1\n"), "not a count"));
  CHECK(has(error("FLASER 3 1 1 0 0 0 0 0 0 1 host 1\n"), ":1: FLASER has 13 words, needs 14"));
  CHECK(has(error("FLASER 2 1 infx 0 0 0 0 0 0 1 host 1\n"), ":1: word 4 of FLASER is `infx`"));
  CHECK(has(error("FLASER 2 1 1 0 0 0 0 0 0 1 host 1e300\n"), ":1: the logger's time"));
  CHECK(has(error(flaser_line(1, 5, 1) + flaser_line(2, 6, 1)), ":2: a scan of 6 beams unlike the first"));
  CHECK(has(error("RAWLASER1 0 -1.5 3 0.02\n"), ":1: RAWLASER1 has no count"));
  CHECK(has(error("RAWLASER1 0 -1.5 3 0 25 0.01 0 2 1 1 0 1 host 1\n"), ":1: angular step"));
  CHECK(has(error("RAWLASER1 0 -1.5 3 0.02 25 0.01 0 9 1 1 0 1 host 1\n"), ":1: RAWLASER1 has fewer than 9"));
  CHECK(has(error("RAWLASER1 0 -1.5 3 0.02 25 0.01 0 2 1 1 9 1 host 1\n"), ":1: RAWLASER1 has 15 words, needs 24"));
  CHECK(has(error("PARAM robot_frontlaser_offset far nohost 0\n"), ":1: word 3 of PARAM is `far`"));
  CHECK(has(error(odom_line(100, {}) + "\n\n" + odom_line(3, {}) + odom_line(101, {})), ":4: time goes back by 97"));
  CHECK(has(error("\x1f\x8b\x08..."), ": is compressed"));
  CHECK(error("") == "");  // an empty log is one; who wants something of it says what is missing
  const auto absent = load_carmen_log("laser", "/nonexistent/drive.log");
  REQUIRE_FALSE(absent.has_value());
  CHECK(has(absent.error().what, "/nonexistent/drive.log: cannot be opened"));
  const CarmenFile file(good);
  CHECK(has(load_carmen_log("laser", file.path, 10).error().what, "at most 10 are read"));
  CHECK_FALSE(load_carmen_log("laser", std::filesystem::temp_directory_path()).has_value());
}

namespace {

bool reports(const CarmenLog& log, const std::string& words) {
  return std::any_of(log.left_out.begin(), log.left_out.end(),
                     [&](const std::string& left) { return has(left, words); });
}

std::string robotlaser_line(double time_s, int beams, double first, const PlanarPose& laser, const PlanarPose& robot) {
  return "ROBOTLASER1 0 -1.5 3 0.02 25.5 0.01 0" + ranges_text(beams, first) + " 1 9" + pose_text(laser) +
         pose_text(robot) + " 0 0 1 1 1e6" + trailer(time_s);
}

}  // namespace

TEST_CASE("ROBOTLASER1 brings its geometry and its poses, which are the odometry where there are no ODOM lines") {
  const std::string scans =
      robotlaser_line(1, 3, 0.5, {1.3, 2, 0}, {1, 2, 0}) + robotlaser_line(2, 3, 0.6, {2.3, 2, 0}, {2, 2, 0});
  const CarmenLog alone = loaded(scans);
  CHECK(alone.beams == 3);
  CHECK(alone.first_angle_rad == -1.5);
  CHECK(alone.max_range_m == 25.5);
  CHECK(alone.laser_ahead_m == doctest::Approx(0.3));
  REQUIRE(alone.scans.size() == 2);
  CHECK(alone.scans[1].time_ns == 2'000'000'000);
  CHECK(alone.scans[1].logged.x_m == 2.3);
  CHECK(alone.range_m[3] == 0.6f);
  REQUIRE(alone.odometry.size() == 2);
  CHECK(alone.odometry[1].time_ns == 2'000'000'000);
  CHECK(alone.odometry[1].pose.x_m == 2);
  CHECK(reports(alone, "no ODOM lines; the poses of its 2 ROBOTLASER1"));
  const CarmenLog both = loaded(odom_line(0.9, {7, 0, 0}) + scans);
  REQUIRE(both.odometry.size() == 1);
  CHECK(both.scans[0].odometry.x_m == 7);
  CHECK(has(error("ROBOTLASER1 0 -1.5 3 0.02 25 0.01 0 2 1 1 0 1 host 1\n"), ":1: ROBOTLASER1 has 15 words, needs 26"));
}

TEST_CASE("a last line that is cut off is left out and reported, wherever it is cut") {
  const std::string whole = odom_line(1001, {1, 2, 0.5}) + flaser_line(1001.25, 4, 1), last = flaser_line(1001.5, 4, 1);
  for (size_t length = 1; length < last.size() - 1; ++length) {
    CAPTURE(length);
    const CarmenLog log = loaded(whole + last.substr(0, length));
    CHECK(log.odometry.size() == 1);
    const bool taken = log.scans.size() == 2;  // its time lacks digits that mean little
    REQUIRE(log.scans.size() == (taken ? 2 : 1));
    // A part of a name is another message, which is counted.
    CHECK((taken || reports(log, "line 3 is cut off") || reports(log, "messages that are not read: 1 ")));
    if (taken) CHECK(log.scans[1].time_ns >= 1'001'000'000'000);
  }
}

TEST_CASE("what is left out of a log is counted: infinite ranges, other messages, lines without a time") {
  const CarmenLog log = loaded("PARAM a b c 0 host 0\nSYNC x 0 host 0\nSYNC x 0 host 0\n" + odom_line(1, {}) +
                               "FLASER 4 inf 1 -inf nan 0 0 0 0 0 0 1.1 host 1.1\n" + rawlaser_line(1.2, 4, 1));
  CHECK(log.range_m == std::vector<float>{0, 1, 0, 0});
  CHECK(reports(log, "3 ranges are inf or NaN"));
  CHECK(reports(log, "messages that are not read: 1 PARAM, 1 RAWLASER1, 2 SYNC"));
  // Six digits since 1970: the times of the senders help, where they are finer.
  std::string coarse, hopeless;
  for (int i = 0; i < 40; ++i) {
    const std::string line = "ODOM 0 0 0 0 0 0 ", end = i < 36 ? " host 1.13486e+09\n" : " host 1.13487e+09\n";
    coarse += line + number(1134864990 + 0.25 * i) + end;
    hopeless += line + (i < 36 ? "1.13486e+09" : "1.13487e+09") + end;
  }
  const CarmenLog fine = loaded(coarse);
  CHECK(fine.odometry.size() == 40);
  CHECK(fine.odometry[39].time_ns - fine.odometry[0].time_ns == 9'750'000'000);
  CHECK(reports(fine, "the logger's times are coarse (2 for 40 lines)"));
  const CarmenLog few = loaded(hopeless);
  CHECK(few.without_time == 35);
  CHECK(reports(few, "35 of 40 scans and ODOM lines are left out"));
}
