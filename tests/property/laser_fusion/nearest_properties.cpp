// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <limits>
#include <random>
#include <vector>

#include "nodes/laser_fusion/generated_pair.hpp"
#include "nodes/laser_fusion/matcher.hpp"
#include "rt/msg/point.hpp"
#include "tests/property_scale.hpp"

using namespace takt;
using namespace takt::laser_fusion;

namespace {

/// Numbers for one round.
class Draw {
 public:
  explicit Draw(uint64_t seed) : bits_(seed) {}
  float uniform(double low, double high) {
    return static_cast<float>(std::uniform_real_distribution<>(low, high)(bits_));
  }
  int below(int count) { return std::uniform_int_distribution<>(0, count - 1)(bits_); }
  Point point(double extent) { return {uniform(-extent, extent), uniform(-extent, extent), uniform(-extent, extent)}; }

 private:
  std::mt19937_64 bits_;
};

bool same(const PairSums& a, const PairSums& b) {
  return a.pairs == b.pairs && a.p1 == b.p1 && a.p2 == b.p2 && a.p2_p1 == b.p2_p1;
}

}  // namespace

TEST_CASE("the table finds the point that looking at every point finds, wherever that is within reach") {
  NearestTable usual(400), small(400, 300);  // one object for all rounds: nothing may be left over from a round
  size_t within = 0, ties = 0;
  for (int round = 0; round < test::rounds(60); ++round) {
    Draw draw(test::seed(static_cast<uint64_t>(round)));
    const double extents[] = {0.05, 1, 6, 300, 2e5}, extent = extents[round % 5];
    const double reach = extent * (round % 2 == 0 ? 0.05 : 0.4);
    const double away = round % 3 == 0 ? 10 * extent : 0;  // of the origin
    const bool lattice = round % 4 == 0;
    const auto place = [&] {
      Point p = draw.point(extent);
      if (lattice) {  // of half the reach: distances equal to it, ties, borders of voxels
        const auto step = static_cast<float>(reach / 2);
        p = {step * static_cast<float>(draw.below(7)), step * static_cast<float>(draw.below(7)), 0};
      }
      return Point{p.x + static_cast<float>(away), p.y, p.z};
    };
    std::vector<Point> points(static_cast<size_t>(draw.below(400)));
    for (Point& p : points) p = place();
    if (points.size() > 3) points[3].y = std::numeric_limits<float>::quiet_NaN();
    NearestTable& table = round % 7 == 0 ? small : usual;
    table.build(points, reach, 1 + round % NearestTable::kMostDivisions);
    for (int i = 0; i < 2000; ++i) {
      const Point at = i % 10 == 0 ? draw.point(20 * extent) : place();
      const Nearest slow = nearest_reference(points, at), fast = table.nearest(at);
      if (slow.distance2 <= static_cast<float>(reach * reach)) {
        ++within;
        REQUIRE(fast.index == slow.index);
        REQUIRE(fast.distance2 == slow.distance2);
        ties += lattice;
      } else {
        REQUIRE(fast.distance2 >= slow.distance2);
      }
    }
  }
  CHECK(within >= test::at_scale(20'000));
  CHECK(ties >= test::at_scale(2'000));
}

TEST_CASE("a pose is judged alike with and without the table, in both metrics, to the last bit") {
  for (uint64_t seed = 1; seed <= test::rounds(12u); ++seed) {
    Draw draw(test::seed(seed));
    const CloudPair pair =
        generate_pair({.points = 300, .overlap = 0.3 + 0.1 * static_cast<double>(seed % 8)}, test::seed(seed));
    for (const Metric metric : {Metric::truncated, Metric::thesis}) {
      Matcher matcher(300, 300, {.metric = metric, .cut_m = seed % 2 == 0 ? 0.25 : 0.6});
      matcher.set(pair.laser.points, pair.vision.points);
      for (int i = 0; i < 12; ++i) {
        const double far = i % 4;  // from the true pose to nowhere near
        PoseParameters pose = to_parameters(pair.vision_in_laser);
        for (size_t k = 0; k < 6; ++k) pose[k] += (k < 3 ? 1.0 : 0.5) * draw.uniform(-far, far);
        const Quality fast = matcher.evaluate(to_rigid(pose));
        const PairSums sums = matcher.pairs();
        const Quality slow = matcher.evaluate_reference(to_rigid(pose));
        REQUIRE(fast.score == slow.score);
        REQUIRE(fast.pairs == slow.pairs);
        REQUIRE(fast.mean_distance_m == slow.mean_distance_m);
        REQUIRE(same(sums, matcher.pairs()));
      }
    }
  }
}
