// SPDX-License-Identifier: Apache-2.0
// Half resolution against the full matcher on made scenes with known disparities.
#include "nodes/stereo/half_resolution.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include "nodes/stereo/window_matcher.hpp"
#include "tests/unit/stereo/scored_result.hpp"

using namespace takt;
using namespace takt::stereo;
using takt::test::ScoredResult;

namespace {

struct MadeScene {
  int width, height;
  std::vector<uint8_t> left, right;
  DisparityImage truth;
};

/// Textured ground that rises towards the camera, and two boxes in front of it. The texture is smooth over about 3 px,
/// as a lens makes it: noise of single pixels would vanish at half resolution.
MadeScene made_scene(int width, int height) {
  const auto count = static_cast<size_t>(width * height);
  MadeScene s{width, height, std::vector<uint8_t>(count), std::vector<uint8_t>(count), {width, height, {}}};
  s.truth.pixels.resize(count);
  std::mt19937 random(5);
  std::vector<int> rough(count);
  for (int& v : rough) v = static_cast<int>(random() % 256);
  const auto at = [&](int x, int y) {
    return static_cast<size_t>(std::clamp(y, 0, height - 1) * width + std::clamp(x, 0, width - 1));
  };
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      int sum = 0;
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) sum += rough[at(x + dx, y + dy)];
      s.right[at(x, y)] = static_cast<uint8_t>(std::clamp((sum / 9 - 128) * 3 + 128, 0, 255));
    }
  const auto inside = [](int x, int y, int x0, int y0, int w, int h) {
    return x >= x0 && x < x0 + w && y >= y0 && y < y0 + h;
  };
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      int d = 4 + y * 20 / height;
      if (inside(x, y, width / 3, height / 5, width / 5, height / 2)) d = 30;
      if (inside(x, y, width * 2 / 3, height / 3, width / 5, height / 2)) d = 43;
      s.truth.at(x, y) = static_cast<float>(d);
      s.left[at(x, y)] = s.right[at(x - d, y)];
    }
  return s;
}

}  // namespace

TEST_CASE(
    "level 1 on a made scene: the same size and unit, an error a few per cent of pixels above the full matcher's") {
  const MadeScene s = made_scene(320, 240);
  MatcherParameters p;
  p.disparities = 64;
  WindowMatcher full(s.width, s.height, 1, p);
  HalfMatcher half_matcher(s.width, s.height, 1, p);
  const ImageView<const uint8_t> left(s.left.data(), s.width, s.height), right(s.right.data(), s.width, s.height);
  const ScoredResult best = test::run(full, left, right, s.truth),
                     worse = test::run(half_matcher, left, right, s.truth);
  MESSAGE("bad pixels: full ", best.score.bad_1px_pct, " %, half ", worse.score.bad_1px_pct, " %; mean error ",
          best.mean_error_px, " and ", worse.mean_error_px, " px");
  CHECK(worse.score.density_pct == 100);
  CHECK(worse.score.bad_1px_pct < 6);
  CHECK(worse.score.bad_1px_pct >= best.score.bad_1px_pct);
  CHECK(worse.mean_error_px < 2);
  size_t even = 0;
  double confidence = 0, best_confidence = 0;
  for (size_t i = 0; i < worse.disparity.size(); ++i) {
    even += worse.disparity[i] % 2 == 0;
    REQUIRE(worse.disparity[i] < 64);
    confidence += worse.confidence[i];
    best_confidence += best.confidence[i];
  }
  CHECK(even == worse.disparity.size());
  CHECK(confidence > 0.55 * best_confidence);  // measured 0.61: odd disparities fall between two
}

TEST_CASE("half of the range finds what lies in it as well as all of the range does, and nothing beyond") {
  const MadeScene s = made_scene(320, 240);
  MatcherParameters p;
  p.disparities = 80;  // the nearer box has 43
  HalfMatcher all(s.width, s.height, 1, p), narrow(s.width, s.height, 1, p);
  narrow.limit_search(40);
  const ImageView<const uint8_t> left(s.left.data(), s.width, s.height), right(s.right.data(), s.width, s.height);
  DisparityImage far = s.truth, near = s.truth;
  for (size_t i = 0; i < s.truth.pixels.size(); ++i) (s.truth.pixels[i] < 40 ? near : far).pixels[i] = 0;
  const double all_pct = test::run(all, left, right, far).score.bad_1px_pct,
               narrow_pct = test::run(narrow, left, right, far).score.bad_1px_pct;
  MESSAGE("bad pixels within half of the range: ", all_pct, " % searching all of it, ", narrow_pct, " % half");
  CHECK(narrow_pct <= all_pct + 0.5);
  CHECK(test::run(all, left, right, near).score.bad_1px_pct < 40);  // measured 32, at the box's edges
  CHECK(test::run(narrow, left, right, near).score.bad_1px_pct > 90);
}

TEST_CASE("odd sizes keep their size; views that do not fit are refused and untouched") {
  const int w = 37, h = 21;
  std::vector<uint8_t> image(static_cast<size_t>(w * h), 7);
  std::vector<int16_t> disparity(image.size(), 99);
  std::vector<uint8_t> confidence(image.size(), 3);
  MatcherParameters p;
  p.disparities = 9;
  HalfMatcher matcher(w, h, 1, p);
  const ImageView<const uint8_t> view(image.data(), w, h);
  CHECK_FALSE(matcher.match(view, {image.data(), w - 1, h}, {{disparity.data(), w, h}, {confidence.data(), w, h}}));
  CHECK(disparity[0] == 99);
  REQUIRE(matcher.match(view, view, {{disparity.data(), w, h}, {confidence.data(), w, h}}));
  for (const int16_t d : disparity) REQUIRE(d == 0);  // no texture: the smallest of equals
}

TEST_CASE("a limited search gives nothing beyond its range") {
  const MadeScene s = made_scene(160, 120);
  MatcherParameters p;
  p.disparities = 64;
  HalfMatcher matcher(s.width, s.height, 1, p);
  matcher.limit_search(20);
  const ScoredResult r =
      test::run(matcher, {s.left.data(), s.width, s.height}, {s.right.data(), s.width, s.height}, s.truth);
  for (const int16_t d : r.disparity) REQUIRE(d < 20);
}
