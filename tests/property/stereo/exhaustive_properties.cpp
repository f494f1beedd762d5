// SPDX-License-Identifier: Apache-2.0
// The fast matchers against the slow reference where random sizes would leave gaps: every width, every search range, an
// image of several strips at the defaults; on every SIMD target.
#include "tests/property/stereo/equal_on_each_target.hpp"
#include "tests/property_scale.hpp"

using namespace takt;
using namespace takt::stereo;
using namespace takt::test;

namespace {

constexpr CostKind kCosts[] = {CostKind::gradient, CostKind::ssd, CostKind::sad, CostKind::census};

}  // namespace

TEST_CASE("every width of 1..200, odd heights of 1..33, every cost and the paths: equal to the reference") {
  std::mt19937 random(test::seed(53));
  for (int width = 1; width <= 200; ++width) {
    const int height = 2 * (width * 5 % 17) + 1, channels = width % 2 ? 3 : 1;
    const Picture left = random_picture(random, width, height, channels, width % 5 ? 256 : 3);
    const Picture right = shifted(random, left, width / 5, 20);
    for (const CostKind cost : kCosts) {
      MatcherParameters p = random_parameters(random, 20);
      p.cost = cost;
      p.c_max = std::min(p.c_max, 48);
      expect_equal_on_each_target(left, right, p);
    }
    MatcherParameters paths = quality_of(1 + width % 20);
    paths.left_right_check = width % 3 == 0;
    paths.subpixel = width % 4 == 0;
    expect_equal_on_each_target(left, right, paths);
  }
}

TEST_CASE("every search range of 1..512: equal to the reference") {
  std::mt19937 random(test::seed(59));
  for (int disparities = 1; disparities <= 512; ++disparities) {
    const Picture left = random_picture(random, 37 + disparities % 3, 3, 1, 256);
    const Picture right = shifted(random, left, disparities % 31, 20);
    MatcherParameters p;
    p.disparities = disparities;
    p.cost = kCosts[disparities % 4];
    p.n_square = p.n_min = 3;
    p.subpixel = disparities % 2 == 0;
    p.uniqueness = disparities % 3 ? 0 : 20;
    expect_equal_on_each_target(left, right, p);
    expect_equal_on_each_target(left, right, quality_of(disparities));
  }
}

TEST_CASE("the defaults on several strips of columns: equal to the reference") {
  std::mt19937 random(test::seed(61));
  const Picture wide = random_picture(random, 700, 15, 1, 256);
  expect_equal_on_each_target(wide, shifted(random, wide, 90, 20), {});
  const Picture left = random_picture(random, 400, 40, 3, 256);
  const Picture right = shifted(random, left, 61, 20);
  expect_equal_on_each_target(left, right, {});
  expect_equal_on_each_target(left, right, quality_of(150));
}
