// SPDX-License-Identifier: Apache-2.0
#include "hal/replay/carmen_log.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "tests/recorded/recording.hpp"

using namespace takt;
using namespace takt::replay;
using takt::test::recording;

namespace {

struct PlanarPoint {
  double x, y;
};
/// End points of a scan's returns nearer than 8 m, from its corrected pose; `turn` +1: beams run counter-clockwise.
std::vector<PlanarPoint> end_points(const CarmenLog& log, size_t scan, int turn) {
  std::vector<PlanarPoint> points;
  const PlanarPose& pose = log.scans[scan].logged;
  for (size_t i = 0; i < log.beams; ++i) {
    const auto range = static_cast<double>(log.range_m[scan * log.beams + i]);
    if (range >= 8) continue;
    const double angle = pose.theta_rad + turn * (log.first_angle_rad + static_cast<double>(i) * log.step_rad);
    points.push_back({pose.x_m + range * std::cos(angle), pose.y_m + range * std::sin(angle)});
  }
  return points;
}

double median(std::vector<double> values) {
  REQUIRE_FALSE(values.empty());
  std::nth_element(values.begin(), values.begin() + static_cast<ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

/// Median distance from an end point to the nearest one of the next scan, over every tenth scan.
double median_gap_m(const CarmenLog& log, int turn) {
  std::vector<double> gaps;
  for (size_t scan = 0; scan + 1 < log.scans.size(); scan += 10) {
    const auto here = end_points(log, scan, turn), next = end_points(log, scan + 1, turn);
    for (size_t i = 0; i < here.size() && !next.empty(); i += 6) {
      double nearest = std::numeric_limits<double>::infinity();
      for (const PlanarPoint& p : next) nearest = std::min(nearest, std::hypot(p.x - here[i].x, p.y - here[i].y));
      gaps.push_back(nearest);
    }
  }
  return median(gaps);
}

void check_recording(const CarmenLog& log) {
  CHECK(std::is_sorted(log.odometry.begin(), log.odometry.end(),
                       [](const TimedPose& a, const TimedPose& b) { return a.time_ns < b.time_ns; }));
  CHECK(log.range_m.size() == log.scans.size() * log.beams);
  CHECK(corrected_poses(log).size() == log.scans.size());
  std::vector<double> distance_error, turn_error;
  for (size_t i = 1; i < log.scans.size(); ++i) {
    const CarmenScan &a = log.scans[i - 1], &b = log.scans[i];
    CHECK(b.time_ns > a.time_ns);
    const PlanarPose by_odometry = between(a.odometry, b.odometry), truly = between(a.logged, b.logged);
    distance_error.push_back(std::hypot(by_odometry.x_m - truly.x_m, by_odometry.y_m - truly.y_m));
    turn_error.push_back(std::abs(std::remainder(by_odometry.theta_rad - truly.theta_rad, 2 * std::numbers::pi)));
  }
  // Odometry is right from scan to scan, and wrong over the whole drive: it is not the corrected trajectory.
  CHECK(median(distance_error) < 0.1);
  CHECK(median(turn_error) < 0.06);
  const PlanarPose by_odometry = between(log.scans.front().odometry, log.scans.back().odometry),
                   truly = between(log.scans.front().logged, log.scans.back().logged);
  CHECK(std::hypot(by_odometry.x_m - truly.x_m, by_odometry.y_m - truly.y_m) > 10);
  for (size_t i = 1; i < log.odometry.size(); ++i) {
    const PlanarPose step = between(log.odometry[i - 1].pose, log.odometry[i].pose);
    CHECK(std::hypot(step.x_m, step.y_m) < 0.3);  // a correction would be a jump
  }
  // Beams run counter-clockwise from the right: seen from corrected poses, walls then stand still.
  CHECK(median_gap_m(log, +1) < 0.06);
  CHECK(median_gap_m(log, -1) > 0.3);
}

}  // namespace

TEST_CASE("recorded: Intel Research Lab") {
  const auto path = recording("sick/carmen/intel-corrected.log");
  const auto log = load_carmen_log("laser", path);
  REQUIRE_MESSAGE(log.has_value(), (log ? "" : log.error().text()));
  CHECK(log->scans.size() == 910);
  CHECK(log->beams == 180);
  CHECK(log->odometry.size() == 14541 - 910);
  CHECK(log->late_stamps > 500);  // its logger was held up many times
  CHECK(log->laser_ahead_m == 0.0);
  check_recording(*log);
}

TEST_CASE("recorded: Freiburg building 101") {
  const auto path = recording("sick/carmen/freiburg-101-corrected.log");
  const auto log = load_carmen_log("laser", path);
  REQUIRE_MESSAGE(log.has_value(), (log ? "" : log.error().text()));
  CHECK(log->scans.size() == 292);
  CHECK(log->beams == 360);
  CHECK(log->odometry.size() == 4569 - 292);
  CHECK(log->late_stamps == 0);
  CHECK(log->laser_ahead_m == -0.04);
  check_recording(*log);
}
