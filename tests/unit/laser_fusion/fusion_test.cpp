// SPDX-License-Identifier: Apache-2.0
#include "nodes/laser_fusion/fusion.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "nodes/laser_fusion/clusters.hpp"
#include "nodes/laser_fusion/thinning.hpp"
#include "rt/msg/point.hpp"

using namespace takt;
using namespace takt::laser_fusion;

TEST_CASE("match probability at 0, sigma, 2 sigma; its colour; how far a match may be") {
  CHECK(match_confidence(0, 0.1) == 1);
  CHECK(match_confidence(0.1, 0.1) == doctest::Approx(0.6065).epsilon(1e-4));
  CHECK(match_confidence(0.2, 0.1) == doctest::Approx(0.1353).epsilon(1e-3));
  CHECK(match_confidence(farthest_match_m({0.2, 0.3}), 0.2) == doctest::Approx(0.3));
  CHECK(confidence_colour(0).r == 255);
  CHECK(confidence_colour(0).g == 0);
  CHECK(confidence_colour(1).r == 0);
  CHECK(confidence_colour(1).g == 255);
  CHECK(confidence_colour(0.6).g == 153);
}

TEST_CASE("each laser point takes the colour of its nearest vision point; those without a match are left out") {
  const FusionParameters p;
  const std::vector<Point> vision{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  const std::vector<Colour> colours{{1, 1, 1}, {2, 2, 2}, {3, 3, 3}};
  NearestTable table(3);
  table.build(vision, farthest_match_m(p));
  const Rigid vision_in_laser = to_rigid({5, 0, 0, std::numbers::pi / 2, 0, 0});  // x of the camera is y of the laser
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<Point> laser{{5, 0.95f, 0}, {nan, 0, 0}, {5, 0.5f, 0}, {5.1f, 2, 0}};
  std::vector<uint8_t> taken;
  std::vector<double> confidence;
  std::vector<float> y;
  fuse(laser, table, colours, vision_in_laser, p, [&](const Point& at, const Colour& colour, double c) {
    taken.push_back(colour.b);
    confidence.push_back(c);
    y.push_back(at.y);
  });
  CHECK(taken == std::vector<uint8_t>{2, 3});
  CHECK(y == std::vector<float>{0.95f, 2});
  CHECK(confidence[0] == doctest::Approx(std::exp(-0.125)).epsilon(1e-4));
  CHECK(confidence[1] == doctest::Approx(std::exp(-0.5)).epsilon(1e-4));
}

TEST_CASE("clusters of too few points are dropped, the others keep their order") {
  std::vector<Point> points;
  for (int i = 0; i < 6; ++i) {
    points.push_back({0.5f * static_cast<float>(5 - i), 0, 0});          // a chain of six
    if (i < 4) points.push_back({0.5f * static_cast<float>(i), 3, 0});   // one of four
    if (i < 5) points.push_back({-1, 0.5f * static_cast<float>(i), 2});  // one of five
  }
  ClusterFilter filter(points.size());
  CHECK(filter.filter(points, {0.5, 1}) == 15);
  std::vector<Point> kept = points;
  REQUIRE(filter.filter(kept, {0.5, 5}) == 11);
  CHECK(kept[0].x == 2.5f);
  CHECK(kept[1].z == 2);
  for (size_t i = 0; i < 11; ++i) CHECK(kept[i].y != 3);
  kept = points;
  CHECK(filter.filter(kept, {0.49, 2}) == 0);
  CHECK(filter.filter({}, {0.5, 1}) == 0);
}

TEST_CASE("clusters are dropped alike in one go and in portions") {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> place(0, 10);
  std::vector<Point> points;
  for (int i = 0; i < 3000; ++i) points.push_back({place(random), place(random), 0});
  std::vector<Point> in_portions = points;
  ClusterFilter filter(points.size());
  const size_t kept = filter.filter(points, {0.2, 10});
  CHECK(kept > 100);
  CHECK(kept < 2900);
  filter.begin(in_portions, {0.2, 10});
  int portions = 1;
  for (; !filter.go_on(); ++portions) {
  }
  CHECK(portions > 5);
  REQUIRE(filter.kept() == kept);
  for (size_t i = 0; i < kept; ++i) REQUIRE(in_portions[i].x == points[i].x);
}

TEST_CASE("a cloud is thinned to what fits, by no more than it takes; a small one stays as it is") {
  std::vector<Point> plane;
  std::vector<Colour> colours;
  for (int i = 0; i < 10'000; ++i) {
    plane.push_back({0.01f * static_cast<float>(i % 100), 0.01f * static_cast<float>(i / 100), 1});
    colours.push_back({7, 8, 9});
  }
  plane[5].x = std::numeric_limits<float>::quiet_NaN();
  std::vector<Point> out(500);
  std::vector<Colour> out_colours(500);
  cloud::CloudBuffer buffer(out, out_colours);
  cloud::VoxelGrid grid(plane.size());
  const double edge_m = thin_out({plane, colours}, 0.02, grid, buffer);
  CHECK(edge_m > 0.04);
  CHECK(edge_m < 0.06);
  CHECK(buffer.size() > 300);
  CHECK(buffer.size() <= 500);
  CHECK(buffer.colours()[0].r == 9);
  CHECK(spacing_of(buffer.points()) == doctest::Approx(edge_m).epsilon(0.2));
  const auto first = cloud::CloudView{std::span<const Point>(plane).first(300), {}};
  CHECK(thin_out(first, 0.02, grid, buffer) == 0);
  CHECK(buffer.size() == 299);
  CHECK(spacing_of(buffer.points()) == doctest::Approx(0.01));
  CHECK(spacing_of({}) == 0);
}
