// SPDX-License-Identifier: Apache-2.0
// Regions, objects and outlines against their plain definitions, on random clouds.
#include <doctest/doctest.h>

#include <algorithm>
#include <random>

#include "nodes/object_3d/outline.hpp"
#include "nodes/object_3d/segmenter.hpp"
#include "rt/msg/point.hpp"
#include "tests/property_scale.hpp"

using namespace takt;
using namespace takt::object_3d;

namespace {

struct RandomCloud {
  std::vector<Point> points;
  std::vector<Colour> colours;
};

/// Clumps, scattered points, or a lattice of just d_max; every third cloud lies 20 km away and far apart.
RandomCloud random_cloud(std::mt19937& random, size_t count, float d_max_m, int kind) {
  RandomCloud cloud;
  std::uniform_real_distribution<float> one(-1, 1);
  const float wide = kind % 3 == 2 ? 20'000.0f : 3.5f * d_max_m;
  for (size_t i = 0; i < count; ++i) {
    Point p{wide * one(random), wide * one(random), wide * one(random)};
    if (kind % 3 == 0)
      p = {d_max_m * std::round(p.x / d_max_m), d_max_m * std::round(p.y / d_max_m),
           d_max_m * std::round(p.z / d_max_m)};
    if (kind % 3 == 2 && i % 4 != 0 && i > 0)
      p = {cloud.points[i - 1].x + 1.5f * d_max_m * one(random), cloud.points[i - 1].y + d_max_m * one(random),
           cloud.points[i - 1].z + d_max_m * one(random)};
    cloud.points.push_back(p);
    const auto level = [&] { return static_cast<uint8_t>(random() % 3 * 100); };
    cloud.colours.push_back({level(), level(), level()});
  }
  return cloud;
}

GrowParameters random_growth(std::mt19937& random, int round) {
  return {std::uniform_real_distribution<float>(0.01f, 0.5f)(random), round % 4 == 1 ? 0.3f : 0.0f,
          round % 5 == 2 ? 7u : 200'000u};
}

}  // namespace

TEST_CASE("region growing finds the points of the plain definition, in its order, from every kind of cloud") {
  std::mt19937 random(test::seed(3));
  RegionGrower grower(400);
  size_t largest = 0, cut = 0;
  for (int round = 0; round < test::rounds(300); ++round) {
    const GrowParameters p = random_growth(random, round);
    const RandomCloud cloud = random_cloud(random, 1 + random() % 400, p.d_max_m, round);
    grower.fill(cloud.points, cloud.colours, p);
    for (int k = 0; k < 4; ++k) {  // one region after the other in the same cloud
      const auto seed = static_cast<uint32_t>(random() % cloud.points.size());
      const Reach reach{p.d_max_m * static_cast<float>(1 + random() % 20), p.d_max_m * 3, p.d_max_m * 5};
      grower.begin(seed, reach);
      while (grower.advance(1 + random() % 50)) {
      }
      const Region wanted = grow_reference(cloud.points, cloud.colours, p, seed, reach);
      const auto got = grower.region();
      REQUIRE(std::equal(got.begin(), got.end(), wanted.points.begin(), wanted.points.end()));
      REQUIRE(grower.cut() == wanted.cut);
      largest = std::max(largest, got.size());
      cut += wanted.cut;
    }
  }
  CHECK(largest > 200);  // that the clouds test something
  CHECK(cut >= test::at_scale(100));
}

TEST_CASE("objects equal those of the plain definition, also where regions overlap or are cut off") {
  std::mt19937 random(test::seed(5));
  Segmenter segmenter(300, 300);
  size_t objects = 0;
  for (int round = 0; round < test::rounds(200); ++round) {
    SegmentParameters p;
    p.grow = random_growth(random, round);
    p.reach = {p.grow.d_max_m * static_cast<float>(2 + random() % 6), 4 * p.grow.d_max_m, 4 * p.grow.d_max_m};
    p.points_min = 1 + random() % 4;
    p.overlap = 0.1 * static_cast<double>(random() % 10);
    const RandomCloud cloud = random_cloud(random, 1 + random() % 300, p.grow.d_max_m, round);
    std::vector<uint32_t> seeds;
    for (uint32_t i = 0; i < cloud.points.size(); ++i)
      if (round % 2 == 0 || random() % 8 == 0) seeds.push_back(i);
    const auto wanted = segment_reference(cloud.points, cloud.colours, seeds, p);
    segmenter.begin(cloud.points, cloud.colours, seeds, p);
    while (segmenter.advance()) {
    }
    REQUIRE(segmenter.segments().size() == wanted.size());
    for (size_t i = 0; i < wanted.size(); ++i) {
      const auto got = segmenter.points_of(segmenter.segments()[i]);
      REQUIRE(std::equal(got.begin(), got.end(), wanted[i].begin(), wanted[i].end()));
    }
    REQUIRE(segmenter.done() == 1);
    objects += wanted.size();
  }
  CHECK(objects >= test::at_scale(1000));
}

TEST_CASE("the hull has the corners of the plain definition, and its rectangle is the smallest of all directions") {
  std::mt19937 random(test::seed(7));
  for (int round = 0; round < test::rounds(400); ++round) {
    std::vector<Point2> points(1 + random() % 40), scratch(2 * points.size() + 2);
    for (Point2& p : points)  // small whole numbers: many equal, many in line
      p = {static_cast<double>(random() % 7), static_cast<double>(random() % 7)};
    auto wanted = convex_hull_reference(points);
    const auto hull = convex_hull(points, scratch);
    std::vector<Point2> got(hull.begin(), hull.end());
    std::sort(got.begin(), got.end());
    std::sort(wanted.begin(), wanted.end());
    if (points.size() == 1 || got.size() == 1) continue;  // no other point to look towards
    REQUIRE(got == wanted);
    if (hull.size() < 3) continue;
    const Rectangle rectangle = smallest_rectangle(hull);
    for (int degree = 0; degree < 180; ++degree) {
      const double c = std::cos(degree * 0.0174533), s = std::sin(degree * 0.0174533);
      double low_u = 1e9, high_u = -1e9, low_v = 1e9, high_v = -1e9;
      for (const Point2& p : hull) {
        low_u = std::min(low_u, c * p.x + s * p.y), high_u = std::max(high_u, c * p.x + s * p.y);
        low_v = std::min(low_v, c * p.y - s * p.x), high_v = std::max(high_v, c * p.y - s * p.x);
      }
      REQUIRE(rectangle.length * rectangle.width <= (high_u - low_u) * (high_v - low_v) + 1e-9);
    }
    for (const Point2& p : hull) {
      const double c = std::cos(rectangle.yaw_rad), s = std::sin(rectangle.yaw_rad);
      const double dx = p.x - rectangle.centre.x, dy = p.y - rectangle.centre.y;
      REQUIRE(std::abs(c * dx + s * dy) <= rectangle.length / 2 + 1e-9);
      REQUIRE(std::abs(c * dy - s * dx) <= rectangle.width / 2 + 1e-9);
    }
  }
}
