// SPDX-License-Identifier: Apache-2.0
#include "nodes/laser_fusion/registration.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <stdexcept>

#include "nodes/laser_fusion/evaluate.hpp"
#include "nodes/laser_fusion/generalised_icp.hpp"
#include "nodes/laser_fusion/icp.hpp"
#include "rt/msg/point.hpp"

using namespace takt;
using namespace takt::laser_fusion;

TEST_CASE("a generated pair is registered from far away, better with all its points than with few") {
  const CloudPair pair = generate_pair({.points = 4000, .offset_m = 1.2, .offset_rad = 1.2}, 3);
  Registration registration(pair.laser.view(), pair.vision.view(), {.points = 500, .genetic = {.generations = 4000}});
  CHECK(registration.fixed_points() <= 500);
  CHECK(registration.moving_points() <= 500);
  CHECK(registration.last_cut_m() < registration.cut_m());
  const Rigid found = registration.search({}), refined = registration.refined(found);
  CHECK(error_of(refined, pair.vision_in_laser).success());
  CHECK(error_of(refined, pair.vision_in_laser).m < error_of(found, pair.vision_in_laser).m);
  CHECK(registration.judged(found).score < registration.judged({}).score);
  CHECK(registration.judged_by_thesis(found).score < 4);
  CHECK_FALSE(error_of(registration.refined(registration.plain({})), pair.vision_in_laser).success());
}

TEST_CASE("a displaced pair is the same pair elsewhere") {
  const CloudPair pair = generate_pair({.points = 500}, 3), other = displaced(pair, 0.4, 0.2, 5);
  CHECK(other.vision_in_laser.t.norm() == doctest::Approx(0.4));
  CHECK(ego_motion::rotation_vector(other.vision_in_laser.R).norm() == doctest::Approx(0.2));
  double farthest_m = 0;
  for (size_t i = 0; i < 500; ++i) {
    const Point &a = pair.vision.points[i], &b = other.vision.points[i];
    farthest_m = std::max(farthest_m, (pair.vision_in_laser * Eigen::Vector3d(a.x, a.y, a.z) -
                                       other.vision_in_laser * Eigen::Vector3d(b.x, b.y, b.z))
                                          .norm());
  }
  CHECK(farthest_m < 1e-5);
}

TEST_CASE("generalised ICP finds exact copies exactly, and surfaces that were seen elsewhere better than plain ICP") {
  const CloudPair pair =
      generate_pair({.points = 1500, .offset_m = 0.2, .offset_rad = 0.15, .vision_sigma_m = 0.003}, 2);
  const Rigid apart = to_rigid({0.1, -0.05, 0.08, 0.1, -0.05, 0.08});
  std::vector<Point> copy;
  for (const Point& p : pair.laser.points) {
    const Eigen::Vector3f q = (apart.inverse() * Eigen::Vector3d(p.x, p.y, p.z)).cast<float>();
    copy.push_back({q.x(), q.y(), q.z()});
  }
  Matcher copies(1500, 1500, {}), seen(1500, 1500, {});
  copies.set(pair.laser.points, copy);
  const PoseError exact = error_of(GeneralisedIcp(copies).run({}), apart);
  CHECK(exact.m < 1e-4);
  CHECK(exact.rad < 1e-4);
  seen.set(pair.laser.points, pair.vision.points);
  const PoseError generalised = error_of(GeneralisedIcp(seen).run({}), pair.vision_in_laser),
                  plain = error_of(icp(seen, {}, {}).moving_in_fixed, pair.vision_in_laser);
  CHECK(generalised.m < 0.01);
  CHECK(generalised.m < plain.m);
  // Clouds that never meet: it stays where it is.
  const Rigid far = to_rigid({100, 0, 0, 0, 0, 0});
  CHECK(GeneralisedIcp(seen).run(far).t == far.t);
}

TEST_CASE("clouds too small are refused") {
  const CloudPair pair = generate_pair({.points = 100}, 1);
  const std::vector<Point> few(5, Point{1, 2, 3});
  CHECK_THROWS_AS(Registration(pair.laser.view(), {few, {}}, {}), std::invalid_argument);
  CHECK_THROWS_AS(Registration({few, {}}, pair.vision.view(), {}), std::invalid_argument);
}
