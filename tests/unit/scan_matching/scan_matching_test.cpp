// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <random>

#include "nodes/scan_matching/evaluate.hpp"
#include "rt/memory/memory_use.hpp"

using namespace takt;
using namespace takt::scan_matching;
using takt::UncertainPose;

namespace {

constexpr double kPi = std::numbers::pi;

/// What a robot sees, as a sweep that owns its ranges.
struct Look {
  std::vector<float> range_m;
  DriveParameters p;
  explicit Look(const std::vector<Wall>& walls, const PlanarPose& robot, double noise_m = 0, uint64_t seed = 1) {
    p.noise_m = noise_m;
    std::mt19937_64 random(seed);
    cast(walls, robot, p, random, range_m);
  }
  Sweep sweep() const { return {-p.field_rad / 2, p.field_rad / static_cast<double>(p.beams - 1), range_m, {}}; }
  std::vector<SurfacePoint> points() const {
    std::vector<SurfacePoint> out;
    points_of(sweep(), 15, out);
    return out;
  }
};

double distance(const PlanarPose& a, const PlanarPose& b) { return std::hypot(a.x_m - b.x_m, a.y_m - b.y_m); }

}  // namespace

TEST_CASE("planar poses: composition undoes `between`, agrees with the poses of rt/transform and with messages") {
  const PlanarPose a{1, -2, 2.5}, b{0.3, 4, -2};
  const PlanarPose back = compose(a, between(a, b));
  CHECK(distance(back, b) < 1e-12);
  CHECK(back.theta_rad == doctest::Approx(b.theta_rad));
  const UncertainPose spatial_pose = compose(spatial(a, Covariance::Zero()), spatial(b, Covariance::Zero()));
  CHECK(distance(planar(spatial_pose.transform), compose(a, b)) < 1e-12);
  CHECK(planar(spatial_pose.transform).theta_rad == doctest::Approx(wrapped(0.5)));
  Covariance c;
  c << 4, 1, 0.5, 1, 3, 0.2, 0.5, 0.2, 2;
  CHECK(planar(spatial(a, c).covariance) == c);
  // Turned by a right angle x becomes y.
  CHECK(turned(c, kPi / 2)(1, 1) == doctest::Approx(4));
  CHECK(turned(c, kPi / 2)(1, 2) == doctest::Approx(0.5));
}

TEST_CASE(
    "points: a wall ahead has the robot's y as its normal, towards it; the mount is applied; far ones are left out") {
  const std::vector<Wall> wall{{-10, 3, 10, 3}};
  Look look(wall, {0, 1, 0});
  std::vector<SurfacePoint> points = look.points();
  REQUIRE(points.size() > 100);
  for (const SurfacePoint& p : points) {
    CHECK(p.y_m == doctest::Approx(2).epsilon(1e-4));
    CHECK(p.ny == doctest::Approx(-1).epsilon(1e-4));
    CHECK(std::hypot(p.x_m, p.y_m) <= 15.001);
  }
  Sweep turned = look.sweep();
  turned.sensor_in_robot = {0.1, 0.5, kPi / 2};
  points_of(turned, 4, points);
  REQUIRE(points.size() > 50);
  for (const SurfacePoint& p : points) {
    CHECK(p.x_m == doctest::Approx(0.1 - 2).epsilon(1e-4));
    CHECK(p.nx == doctest::Approx(1).epsilon(1e-4));
    CHECK(std::hypot(p.x_m - 0.1, p.y_m - 0.5) <= 4.001);
  }
}

TEST_CASE("points: no normal at a corner, across a gap, or with fewer than four on a surface") {
  const std::vector<Wall> corner{{-3, 2, 0, 4}, {0, 4, 3, 2}};
  Look look(corner, {});
  const std::vector<SurfacePoint> points = look.points();
  const auto nearest = std::min_element(points.begin(), points.end(), [](const SurfacePoint& a, const SurfacePoint& b) {
    return std::abs(a.x_m) < std::abs(b.x_m);
  });
  CHECK_FALSE(nearest->has_normal());
  CHECK(points[5].has_normal());
  std::vector<float> steps(181, 0.0f);
  for (size_t i = 0; i < steps.size(); ++i) steps[i] = (i / 3) % 2 == 0 ? 2.0f : 4.0f;  // three beams a surface
  std::vector<SurfacePoint> stairs;
  points_of({-kPi / 2, kPi / 180, steps, {}}, 15, stairs);
  CHECK(stairs.size() == 181);
  for (const SurfacePoint& p : stairs) CHECK_FALSE(p.has_normal());
}

TEST_CASE("a scan of a room is put back where it was taken, from 30 cm and 15 degrees beside") {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    CAPTURE(seed);
    const auto room = furnished_room(seed);
    Parameters p;
    LocalMap map(181, p.map);
    const PlanarPose at{0.2, -0.1, 0.4}, now{0.35, 0.1, 0.55};
    map.add(at, Look(room, at).points());
    CorrelativeSearch search(181, p.search, p.map.cell_m);
    const Expected expected{{now.x_m + 0.25, now.y_m - 0.17, now.theta_rad + 0.26}, 0.2, 0.2};
    const auto points = Look(room, now).points();
    const Found found = search.find(map.field(), points, expected);
    CHECK(distance(found.robot_in_map, now) < 0.08);
    CHECK(std::abs(wrapped(found.robot_in_map.theta_rad - now.theta_rad)) < 0.02);
    const Refined refined = refine(map, points, expected, found.robot_in_map, p.refine);
    CHECK(refined.converged);
    CHECK(refined.prior_share < 0.05);
    CHECK(distance(refined.robot_in_map, now) < 0.005);
    CHECK(std::abs(wrapped(refined.robot_in_map.theta_rad - now.theta_rad)) < 0.002);
  }
}

TEST_CASE("a drive through a furnished room: far better than its odometry, and the covariance says how good") {
  for (uint64_t seed = 1; seed <= 3; ++seed) {
    CAPTURE(seed);
    const Drive drive = make_drive(furnished_room(seed), rounds(150), {}, seed);
    const Evaluation with = evaluate(drive, {}, true, {});
    CHECK(with.outcomes[static_cast<size_t>(Outcome::matched)] == with.steps);
    CHECK(with.matched.error_m < 0.006);
    CHECK(with.matched.error_deg < 0.1);
    CHECK(with.matched.within_pct == 100);
    CHECK(with.matched.error_m < 0.7 * with.odometry.error_m);
    CHECK(with.matched.error_deg < 0.3 * with.odometry.error_deg);
    CHECK(with.matched.end_error_m < 0.1);
    CHECK(with.within_95_pct > 85);
    const Evaluation without = evaluate(drive, {}, false, {});
    CHECK(without.matched.error_m < 0.008);
    CHECK(without.matched.within_pct > 99);
  }
}

TEST_CASE("how far two ways of matching lie apart tells the errors of a truth from their own") {
  Drive drive = make_drive(furnished_room(4), rounds(100), {}, 4);
  const Evaluation exact = evaluate(drive, {}, true, {});
  CHECK(exact.apart_deg > 0);
  CHECK(exact.apart_deg < 2 * exact.matched.error_deg + 0.1);
  for (size_t i = 0; i < drive.scans.size(); i += 2) drive.scans[i].truth.theta_rad += 0.01;
  const Evaluation spoilt = evaluate(drive, {}, true, {});
  CHECK(spoilt.apart_deg == exact.apart_deg);
  CHECK(spoilt.apart_m == exact.apart_m);
  CHECK(spoilt.matched.error_deg > 5 * spoilt.apart_deg);
}

TEST_CASE("along a corridor the odometry speaks, with its uncertainty; across it the walls do") {
  std::vector<PlanarPose> straight;
  for (int i = 0; i < 20; ++i) straight.push_back({0.1, 0.2 * i, 0});
  const Drive drive = make_drive(corridor(), straight, {}, 3);
  const Parameters p;
  ScanMatcher matcher(drive.beams, p);
  for (size_t i = 0; i < drive.scans.size(); ++i) {
    const Match match = matcher.step(drive.sweep(i), 0.2, i > 0 ? std::optional(drive.moved(i)) : std::nullopt);
    if (i == 0) continue;
    REQUIRE(match.outcome == Outcome::matched);
    CHECK(match.refined.prior_share > 0.7);  // noise turns normals a little: walls seem to say something
    const double sigma_m = p.odometry_floor_m + p.odometry_error * std::hypot(drive.moved(i).x_m, drive.moved(i).y_m);
    CHECK(std::sqrt(match.covariance(1, 1)) == doctest::Approx(sigma_m).epsilon(0.1));
    CHECK(std::abs(match.robot_in_previous.y_m - drive.moved(i).y_m) < 0.02);
    CHECK(std::sqrt(match.covariance(0, 0)) < 0.2 * sigma_m);
    CHECK(std::abs(match.robot_in_map.x_m) < 0.02);
  }
}

TEST_CASE("refusals are told, carry what was expected with its uncertainty, and end") {
  const auto room = furnished_room(1);
  Parameters p;
  ScanMatcher matcher(181, p);
  const Look here(room, {});
  CHECK(matcher.step(here.sweep(), 0, std::nullopt).outcome == Outcome::first);

  // Hardly anything comes back.
  Look blind = here;
  std::fill(blind.range_m.begin() + 10, blind.range_m.end(), 0.0f);
  const PlanarPose moved{0.02, 0.3, 0.1};
  Match match = matcher.step(blind.sweep(), 0.2, moved);
  CHECK(match.outcome == Outcome::too_few_points);
  CHECK_FALSE(match.accepted());
  CHECK(distance(match.robot_in_map, moved) < 1e-12);
  const double sigma_m = p.odometry_floor_m + p.odometry_error * std::hypot(moved.x_m, moved.y_m);
  CHECK(match.covariance(0, 0) == doctest::Approx(sigma_m * sigma_m));
  CHECK(match.accumulated.covariance[0] == doctest::Approx(sigma_m * sigma_m));

  // Back to where it was: the map is still there.
  match = matcher.step(here.sweep(), 0.2, between(moved, {}));
  CHECK(match.outcome == Outcome::matched);
  CHECK(distance(match.robot_in_map, {}) < 0.01);

  // The longer it saw nothing, the less the expectation weighs against the map.
  for (int i = 0; i < 4; ++i) CHECK_FALSE(matcher.step(blind.sweep(), 0.2, PlanarPose{0, 0.05, 0}).accepted());
  match = matcher.step(here.sweep(), 0.2, PlanarPose{});
  CHECK(match.outcome == Outcome::matched);
  CHECK(distance(match.robot_in_map, {}) < 0.004);

  // A place of which the map knows nothing; after some refusals the map is made anew there.
  const std::vector<Wall> elsewhere{{-0.8, 0.5, 0.9, 0.7}, {0.9, 0.7, 1.1, -3}, {-0.8, 0.5, -0.7, -3}};
  const Look strange(elsewhere, {});
  for (int i = 1; i <= p.refused_most; ++i) {
    match = matcher.step(strange.sweep(), 0.2, PlanarPose{});
    CHECK_FALSE(match.accepted());
    CHECK(match.map_anew == (i == p.refused_most));
  }
  match = matcher.step(strange.sweep(), 0.2, PlanarPose{});
  CHECK(match.outcome == Outcome::matched);
  CHECK(distance(match.robot_in_map, {}) < 0.05);
}

TEST_CASE("without anything on lines no map begins") {
  ScanMatcher matcher(181, {});
  const std::vector<float> nothing(181, 0.0f);
  for (int i = 0; i < 10; ++i)
    CHECK(matcher.step({-kPi / 2, kPi / 180, nothing, {}}, 0.1, std::nullopt).outcome == Outcome::too_few_points);
  const Look here(furnished_room(1), {});
  CHECK(matcher.step(here.sweep(), 0.1, std::nullopt).outcome == Outcome::first);
}

TEST_CASE("the pose that a matcher resumes from is that of its first scan") {
  ScanMatcher matcher(181, {});
  Covariance c = Covariance::Identity() * 0.01;
  matcher.resume(spatial({3, 4, 1}, c));
  const Look here(furnished_room(1), {});
  const Match match = matcher.step(here.sweep(), 0, std::nullopt);
  CHECK(match.outcome == Outcome::first);
  CHECK(distance(match.robot_in_map, {3, 4, 1}) == 0);
  CHECK(planar(match.accumulated.covariance).isApprox(c, 1e-9));
}

TEST_CASE("no step allocates, the first one and one with a new keyframe included") {
  if (!takt::counting_allocations()) {
    MESSAGE("NOT RUN: this program does not count allocations (sanitizer)");
    return;
  }
  const Drive drive = make_drive(furnished_room(2), rounds(60), {}, 2);
  Parameters p;
  p.map.keyframes = 4;
  p.keyframe_m = 0.1;
  ScanMatcher matcher(drive.beams, p);
  size_t keyframes = 0;
  for (size_t i = 0; i < drive.scans.size(); ++i) {
    const std::optional<PlanarPose> moved = i > 0 ? std::optional(drive.moved(i)) : std::nullopt;
    const uint64_t before = takt::thread_memory_use().allocations;
    keyframes += matcher.step(drive.sweep(i), 0.2, moved).keyframe;
    CHECK(takt::thread_memory_use().allocations == before);
  }
  CHECK(keyframes > 10);
}
