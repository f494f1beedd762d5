// SPDX-License-Identifier: Apache-2.0
#include "nodes/ego_motion/motion.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <random>
#include <vector>

#include "nodes/ego_motion/estimator.hpp"
#include "nodes/ego_motion/evaluate.hpp"

using namespace takt::ego_motion;

namespace {

constexpr Optics kOptics{492.8, 0.24};

Observation seen(const Eigen::Vector3d& before, const Eigen::Vector3d& now) {
  const double f = kOptics.focal_px, B = kOptics.baseline_m;
  return {f * before.x() / before.z(), f * before.y() / before.z(), f * B / before.z(),
          f * now.x() / now.z(),       f * now.y() / now.z(),       f * B / now.z()};
}

std::vector<Eigen::Vector3d> scene(int count) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < count; ++i)
    points.emplace_back(-3 + 6 * unit(random), -1.5 + 3 * unit(random), 2 + 8 * unit(random));
  return points;
}

std::vector<Observation> observe(const Rigid& T, int count, double noise_px = 0) {
  std::mt19937 random(11);
  std::normal_distribution<double> noise(0, 1);
  std::vector<Observation> out;
  for (const auto& p : scene(count)) {
    Observation o = seen(p, T * p);
    o.x_current += noise_px * noise(random);
    o.y_current += noise_px * noise(random);
    o.d_current += noise_px * noise(random);
    out.push_back(o);
  }
  return out;
}

}  // namespace

TEST_CASE("oracle 16: both linear forms recover a motion made with the linearised T to 1e-9") {
  const double alpha = 0.01, tx = 0.02, tz = -0.10;
  Eigen::Matrix3d linear;
  linear << 1, 0, alpha, 0, 1, 0, -alpha, 0, 1;
  std::vector<Observation> all;
  for (const auto& p : scene(80)) all.push_back(seen(p, linear * p + Eigen::Vector3d(tx, 0, tz)));
  for (Form form : {Form::multiplied, Form::division}) {
    const auto m = planar_least_squares(all, kOptics, form);
    REQUIRE(m);
    CHECK(std::abs(m->alpha_rad - alpha) < 1e-9);
    CHECK(std::abs(m->tx_m - tx) < 1e-9);
    CHECK(std::abs(m->tz_m - tz) < 1e-9);
  }
}

TEST_CASE("oracle 16: with an exact rotation the linear form errs below 3e-4, Gauss-Newton below 1e-9") {
  const Rigid T = to_rigid({0.01, 0.02, -0.10});
  const auto all = observe(T, 80);
  const auto m = planar_least_squares(all, kOptics, Form::multiplied);
  REQUIRE(m);
  CHECK(std::abs(m->alpha_rad - 0.01) < 3e-4);
  CHECK(std::abs(m->tx_m - 0.02) < 3e-4);
  CHECK(std::abs(m->tz_m + 0.10) < 3e-4);
  for (Model model : {Model::six_dof, Model::planar}) {
    MotionEstimator estimator({model}, all.size());
    const Estimate e = estimator.estimate(all, kOptics, {}, 1);
    REQUIRE(e.solved);
    CHECK((e.T.t - T.t).norm() < 1e-9);
    CHECK(rotation_vector(e.T.R.transpose() * T.R).norm() < 1e-9);
    CHECK(e.inliers == 80);
  }
}

TEST_CASE("the division form is worse than the multiplied form under noise (erratum note of 8.2)") {
  const auto all = observe(to_rigid({0.01, 0.02, -0.10}), 80, 0.5);
  const auto error = [&](Form form) {
    const auto m = planar_least_squares(all, kOptics, form);
    return std::hypot(m->tx_m - 0.02, m->tz_m + 0.10);
  };
  CHECK(error(Form::multiplied) < 0.01);
  CHECK(error(Form::division) > 2 * error(Form::multiplied));
}

TEST_CASE("six degrees of freedom survive 45 % outliers and missing disparities") {
  const Rigid T{rotation({0.01, 0.03, -0.02}), {0.05, -0.02, -0.30}};
  auto all = observe(T, 300, 0.1);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> anywhere(-200, 200);
  for (size_t i = 0; i < 135; ++i) all[i].x_current = anywhere(random), all[i].y_current = anywhere(random);
  for (size_t i = 135; i < 200; ++i) all[i].d_current = -1;
  MotionEstimator estimator({}, all.size());
  const Estimate e = estimator.estimate(all, kOptics, {}, 5);
  REQUIRE(e.solved);
  CHECK((e.T.t - T.t).norm() < 0.005);
  CHECK(rotation_vector(e.T.R.transpose() * T.R).norm() < 0.0008);
  CHECK(e.inliers >= 155);
  CHECK(e.inliers <= 175);
}

TEST_CASE("the planar model lets pitch leak into t_z, six degrees of freedom do not (correction 2)") {
  const Rigid T{rotation({0.2 * 3.14159265 / 180, 0, 0}), {0, 0, -0.10}};
  // Mostly below the horizon, as on a floor: there pitch and approach look alike.
  std::vector<Observation> all;
  for (auto p : scene(200)) p.y() = std::abs(p.y()) + 0.3, all.push_back(seen(p, T * p));
  const auto tz = [&](Model model) {
    EstimatorParameters p{model};
    p.inlier_px = 20;
    return MotionEstimator(p, all.size()).estimate(all, kOptics, {}, 1).T.t.z();
  };
  CHECK(std::abs(tz(Model::six_dof) + 0.10) < 1e-9);
  CHECK(std::abs(tz(Model::planar) + 0.10) > 0.003);
}

TEST_CASE("too few or degenerate corners are not solved") {
  MotionEstimator estimator({}, 10);
  const std::vector<Observation> same(10, seen({0, 0, 4}, {0, 0, 4}));
  CHECK_FALSE(estimator.estimate(std::span(same).first(3), kOptics, {}, 1).solved);
  CHECK_FALSE(planar_least_squares(same, kOptics, Form::multiplied));
}

TEST_CASE("rigid motions: exponential, logarithm, message round trip") {
  const Rigid T{rotation({0.3, -2.0, 0.7}), {1, 2, 3}};
  CHECK((rotation_vector(T.R) - Eigen::Vector3d(0.3, -2.0, 0.7)).norm() < 1e-12);
  const Rigid back = from_transform(to_transform(T)) * T.inverse();
  CHECK((back.R - Eigen::Matrix3d::Identity()).norm() < 1e-12);
  CHECK(back.t.norm() < 1e-12);
  const Rigid half = scaled({rotation({0, 0.2, 0}), {0, 0, 2}}, 0.5);
  CHECK((rotation_vector(half.R) - Eigen::Vector3d(0, 0.1, 0)).norm() < 1e-12);
  CHECK(half.t.z() == doctest::Approx(1));
}

TEST_CASE("evaluate: end error over path length and median turn error") {
  std::vector<Rigid> truth(11), estimated(11);
  const double turn = 0.1 * 3.14159265358979 / 180;
  for (size_t i = 1; i < truth.size(); ++i) {
    truth[i].t = {0, 0, static_cast<double>(i)};
    estimated[i].R = rotation({0, turn * static_cast<double>(i), 0});
    estimated[i].t = {0, 0, 1.02 * static_cast<double>(i)};
  }
  const Quality q = evaluate(estimated, truth);
  CHECK(q.path_m == doctest::Approx(10));
  CHECK(q.drift_pct == doctest::Approx(2));
  CHECK(q.deg_per_frame == doctest::Approx(0.1));
  // A common offset of one list changes nothing.
  const Rigid offset{rotation({0.4, 0.1, 1.0}), {5, 6, 7}};
  for (Rigid& pose : estimated) pose = offset * pose;
  CHECK(evaluate(estimated, truth).drift_pct == doctest::Approx(2));
  CHECK(evaluate({}, truth).path_m == 0);
}
