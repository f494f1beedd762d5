// SPDX-License-Identifier: Apache-2.0
#include "nodes/laser_fusion/icp.hpp"

#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "nodes/laser_fusion/evaluate.hpp"
#include "nodes/laser_fusion/generated_pair.hpp"
#include "rt/msg/point.hpp"

using namespace takt;
using namespace takt::laser_fusion;
using Eigen::Vector3d;

namespace {

const PoseParameters kPose{0.3, -1.2, 0.5, 0.7, -0.4, 1.1};

struct Pairs {
  std::vector<Vector3d> fixed, moving;
  PairSums sums;
};

/// Pairs of kPose, the fixed ones with noise.
Pairs make_pairs(double sigma_m) {
  std::mt19937 random(5);
  std::normal_distribution<> noise(0, sigma_m > 0 ? sigma_m : 1);
  std::uniform_real_distribution<> place(-2, 2);
  Pairs pairs;
  for (int i = 0; i < 40; ++i) {
    const Vector3d moving(place(random), place(random), place(random));
    const Vector3d error = sigma_m > 0 ? Vector3d(noise(random), noise(random), noise(random)) : Vector3d(0, 0, 0);
    pairs.moving.push_back(moving);
    pairs.fixed.push_back(to_rigid(kPose) * moving + error);
    pairs.sums.add(pairs.fixed.back(), moving);
  }
  return pairs;
}

Quality judged(const std::vector<Point>& fixed, const std::vector<Point>& moving, const QualityParameters& p) {
  Matcher matcher(fixed.size(), moving.size(), p);
  matcher.set(fixed, moving);
  return matcher.evaluate({});
}

}  // namespace

TEST_CASE("a pose is yaw, then pitch, then roll, and comes back from its matrix") {
  const double quarter = std::numbers::pi / 2;
  const Vector3d x = Vector3d::UnitX(), y = Vector3d::UnitY(), z = Vector3d::UnitZ();
  CHECK((to_rigid({0, 0, 0, quarter, 0, 0}) * x - y).norm() < 1e-15);
  CHECK((to_rigid({0, 0, 0, 0, quarter, 0}) * y - z).norm() < 1e-15);
  CHECK((to_rigid({0, 0, 0, 0, 0, quarter}) * z - x).norm() < 1e-15);
  CHECK((to_rigid({0, 0, 0, quarter, quarter, 0}) * y - z).norm() < 1e-15);  // the pitch first, then the yaw
  const PoseParameters back = to_parameters(to_rigid(kPose));
  for (size_t i = 0; i < 6; ++i) CHECK(back[i] == doctest::Approx(kPose[i]));
  for (const double pitch : {quarter, -quarter}) {
    const Rigid locked = to_rigid({0, 0, 0, 0.4, pitch, 0.9});
    CHECK((to_rigid(to_parameters(locked)).R - locked.R).norm() < 1e-9);
  }
}

TEST_CASE("the quaternion fit finds the motion of exact pairs, and of noisy ones what least squares by SVD finds") {
  const Rigid exact = fit_rigid(make_pairs(0).sums);
  CHECK((exact.R - to_rigid(kPose).R).norm() < 1e-12);
  CHECK((exact.t - to_rigid(kPose).t).norm() < 1e-12);
  const Pairs noisy = make_pairs(0.1);
  Eigen::Matrix3Xd from(3, 40), to(3, 40);
  for (int i = 0; i < 40; ++i) {
    from.col(i) = noisy.moving[static_cast<size_t>(i)];
    to.col(i) = noisy.fixed[static_cast<size_t>(i)];
  }
  const Eigen::Matrix4d by_svd = Eigen::umeyama(from, to, false);
  const Rigid found = fit_rigid(noisy.sums);
  CHECK((found.R - by_svd.topLeftCorner<3, 3>()).norm() < 1e-9);
  CHECK((found.t - by_svd.topRightCorner<3, 1>()).norm() < 1e-9);
}

TEST_CASE("locked parameters stay to the last bit; the others still fit") {
  const Pairs pairs = make_pairs(0);
  const PoseParameters start{9, 9, kPose[kZ], 3, kPose[kPitch], kPose[kRoll]};
  const PoseParameters found = fit_rigid(pairs.sums, start, {false, false, true, false, true, true});
  for (const Parameter p : {kZ, kPitch, kRoll}) CHECK(found[p] == start[p]);
  for (const Parameter p : {kX, kY, kYaw}) CHECK(found[p] == doctest::Approx(kPose[p]));
}

TEST_CASE("Eq. 4.18: its four corners; it falls with the share and rises with the distance") {
  const QualityParameters p;
  CHECK(thesis_score(1, 0, p) == 1);
  CHECK(thesis_score(0, 0, p) == 2);
  CHECK(thesis_score(1, 1, p) == 2);
  CHECK(thesis_score(0, 1, p) == 4);
  for (double at = 0; at < 1; at += 0.1) {
    CHECK(thesis_score(at + 0.1, 0.3, p) < thesis_score(at, 0.3, p));
    CHECK(thesis_score(0.3, at + 0.1, p) > thesis_score(0.3, at, p));
  }
  CHECK(thesis_score(0.5, 0.25, {.share_exponent = 1, .distance_exponent = 1}) == 1.5 * 1.25);
}

TEST_CASE("what counts as a pair, and what a cloud of few pairs is worth") {
  std::vector<Point> fixed, moving;
  for (int i = 0; i < 8; ++i) {  // a metre apart; distances 0.1, 0.2 .. 0.8
    const auto x = static_cast<float>(i);
    fixed.push_back({x, 0, 0});
    moving.push_back({x, 0.1f * (x + 1), 0});
  }
  const Quality cut = judged(fixed, moving, {.cut_m = 0.65});
  CHECK(cut.pairs == 6);
  CHECK(cut.mean_distance_m == doctest::Approx(0.35));
  CHECK(cut.score == doctest::Approx((6 * 0.35 + 2 * 0.65) / 8));
  CHECK(std::isinf(judged(fixed, moving, {.cut_m = 0.55}).score));  // five pairs
  const Quality thesis = judged(fixed, moving, {.metric = Metric::thesis});
  CHECK(thesis.pairs == 3);  // up to (0.8 - 0.1) / 2
  CHECK(std::isinf(thesis.score));
  for (size_t i = 0; i < 8; ++i) moving[i].y = 0.5f;  // all equal: the limit would be 0
  const Quality equal = judged(fixed, moving, {.metric = Metric::thesis});
  CHECK(equal.pairs == 8);
  CHECK(equal.score == doctest::Approx(1 + std::sqrt(0.5)));
  for (Point& p : moving) p.y = 0;
  fixed[7].x = 30;  // far beyond the reach of the table
  const Quality far = judged(fixed, moving, {.metric = Metric::thesis});
  CHECK(far.pairs == 7);
  CHECK(far.score == doctest::Approx(2 - 49.0 / 64));
  CHECK(std::isinf(judged(fixed, {}, {}).score));
  CHECK(std::isinf(judged({}, moving, {}).score));
}

TEST_CASE("ICP brings similar clouds together from a small offset, and never makes it worse") {
  for (const Metric metric : {Metric::truncated, Metric::thesis}) {
    for (uint64_t seed = 1; seed <= 3; ++seed) {
      const CloudPair pair = generate_pair({.offset_m = 0.1, .offset_rad = 0.05}, seed);
      Matcher matcher(1000, 1000, {.metric = metric});
      matcher.set(pair.laser.points, pair.vision.points);
      const IcpResult found = icp(matcher, {}, {});
      CHECK(found.quality.score < matcher.evaluate({}).score);
      if (metric == Metric::thesis) continue;  // whose best pose may be another one (C-4)
      const PoseError error = error_of(found.moving_in_fixed, pair.vision_in_laser);
      CHECK(error.m < 0.06);  // the noise of 1000 points, none of which is seen twice
      CHECK(error.rad < 0.03);
      CHECK(found.iterations > 2);
    }
  }
}
