// SPDX-License-Identifier: Apache-2.0
// The fast matchers against the slow reference where random sizes would leave gaps: every width, every search range, an
// image of several strips at the defaults, a piece of a recorded pair; on every SIMD target.
#include <opencv2/imgcodecs.hpp>

#include "nodes/stereo/reference.hpp"
#include "nodes/stereo/semi_global_matcher.hpp"
#include "nodes/stereo/window_matcher.hpp"
#include "tests/on_each_target.hpp"
#include "tests/property/stereo/random_pairs.hpp"
#include "tests/test_data.hpp"

using namespace takt;
using namespace takt::stereo;
using namespace takt::test;

namespace {

constexpr CostKind kCosts[] = {CostKind::gradient, CostKind::ssd, CostKind::sad, CostKind::census};

/// The reference once, then the matcher that make_matcher() chooses on each target.
void expect_equal_on_each_target(const Picture& left, const Picture& right, const MatcherParameters& p) {
  Output expected(left);
  if (p.selection == Selection::semi_global) reference::semi_global(left.view(), right.view(), p, expected.views(left));
  else reference::match(left.view(), right.view(), p, expected.views(left));
  on_each_target([&] {
    const auto matcher = make_matcher(left.width, left.height, left.channels, p);
    REQUIRE(std::string_view(matcher->target()) != "scalar");  // not the general one
    expect_equal(*matcher, left, right, p, expected);
  });
}

MatcherParameters quality_of(int disparities) {
  MatcherParameters p = MatcherParameters::quality();
  p.disparities = disparities;
  return p;
}

}  // namespace

TEST_CASE("every width of 1..200, odd heights of 1..33, every cost and the paths: equal to the reference") {
  std::mt19937 random(53);
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
  std::mt19937 random(59);
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
  std::mt19937 random(61);
  const Picture wide = random_picture(random, 700, 15, 1, 256);
  expect_equal_on_each_target(wide, shifted(random, wide, 90, 20), {});
  const Picture left = random_picture(random, 400, 40, 3, 256);
  const Picture right = shifted(random, left, 61, 20);
  expect_equal_on_each_target(left, right, {});
  expect_equal_on_each_target(left, right, quality_of(150));
}

TEST_CASE("a piece of a recorded pair, the defaults and the quality matcher: equal to the reference") {
  const auto folder = recording("stereo/teddy");
  if (!folder) return;
  const cv::Rect piece(120, 150, 250, 41);
  const auto read = [&](const char* name) {
    const cv::Mat image = cv::imread((*folder / name).string())(piece).clone();
    return Picture{piece.width, piece.height, 3, {image.data, image.data + image.total() * 3}};
  };
  const Picture left = read("im2.png"), right = read("im6.png");
  MatcherParameters p;
  p.disparities = 64;
  expect_equal_on_each_target(left, right, p);
  expect_equal_on_each_target(left, right, quality_of(64));
}
