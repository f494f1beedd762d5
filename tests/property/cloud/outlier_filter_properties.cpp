// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>
#include <hwy/targets.h>

#include <random>
#include <vector>

#include "nodes/cloud/outlier_filter.hpp"
#include "rt/msg/point.hpp"
#include "tests/property_scale.hpp"

using namespace takt::cloud;
using takt::Point;

TEST_CASE("the grid decides like every point against every other, on every SIMD target") {
  const std::vector<int64_t> targets = hwy::SupportedAndGeneratedTargets();
  std::mt19937 random(takt::test::seed(1));
  const auto uniform = [&](double low, double high) {
    return static_cast<float>(std::uniform_real_distribution<>(low, high)(random));
  };
  OutlierFilter filter(3000);  // one object for all rounds: nothing may be left over from a round
  for (int round = 0; round < takt::test::rounds(150); ++round) {
    hwy::SetSupportedTargetsForTest(targets[static_cast<size_t>(round / 5) % targets.size()]);
    CAPTURE(simd_target());
    const auto count = static_cast<size_t>(std::uniform_int_distribution<>(0, 1500)(random));
    // From crowded to a scene so vast that cells share buckets.
    const double extent[] = {0.3, 2, 20, 500, 20000};
    const double size = extent[round % 5];
    const double radius = round % 5 == 4 ? 0.05 : 0.2;
    std::vector<Point> points;
    while (points.size() < count) {
      const Point centre{uniform(-size, size), uniform(-size, size), uniform(-size / 3, size / 3)};
      for (int k = std::uniform_int_distribution<>(1, 30)(random); k > 0 && points.size() < count; --k)
        points.push_back({centre.x + uniform(-0.3, 0.3), centre.y + uniform(-0.3, 0.3), centre.z + uniform(-0.3, 0.3)});
    }
    if (round % 7 == 0)  // on a lattice of the radius: distances equal to it, points on cell borders
      for (Point& p : points) {
        const auto r = static_cast<float>(radius);
        p = {r * static_cast<float>(static_cast<int>(random() % 9)),
             r * static_cast<float>(static_cast<int>(random() % 9)), -r * static_cast<float>(random() % 5)};
      }
    const OutlierParameters p{radius, std::uniform_int_distribution<>(0, 25)(random)};
    std::vector<uint8_t> fast(count, 7), slow(count, 8);
    const size_t kept = filter.filter(points, p, fast);
    CHECK(kept == OutlierFilter::filter_reference(points, p, slow));
    CHECK(fast == slow);
  }
  hwy::SetSupportedTargetsForTest(0);
}
