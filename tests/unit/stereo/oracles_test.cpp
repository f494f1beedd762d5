// SPDX-License-Identifier: Apache-2.0
// Numeric oracles 2 to 6 (examples with known results), and the edges of the interface.
#include <doctest/doctest.h>

#include <cmath>
#include <random>
#include <vector>

#include "nodes/stereo/evaluate.hpp"
#include "nodes/stereo/half_resolution.hpp"
#include "nodes/stereo/matcher.hpp"
#include "nodes/stereo/reference.hpp"
#include "nodes/stereo/triangulate.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/point.hpp"

using namespace takt;
using namespace takt::stereo;

namespace {

std::vector<uint8_t> noise(size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<uint8_t> v(count);
  for (auto& x : v) x = static_cast<uint8_t>(random());
  return v;
}

struct MatchResult {
  std::vector<int16_t> disparity;
  std::vector<uint8_t> confidence;
};

MatchResult match(const std::vector<uint8_t>& left, const std::vector<uint8_t>& right, int width, int height,
                  int channels, const MatcherParameters& p) {
  const auto count = static_cast<size_t>(width * height);
  MatchResult r{std::vector<int16_t>(count, -9), std::vector<uint8_t>(count)};
  const auto matcher = make_matcher(width, height, channels, p);
  REQUIRE(matcher->match({left.data(), width, height, channels}, {right.data(), width, height, channels},
                         {{r.disparity.data(), width, height}, {r.confidence.data(), width, height}}));
  return r;
}

}  // namespace

TEST_CASE("oracle 2: running window sums equal the direct double loop") {
  const int w = 40, h = 20;
  const auto left = noise(w * h, 1), right = noise(w * h, 2);
  MatcherParameters p;
  p.disparities = 1;  // one disparity: the confidence shows the sum itself
  p.n_min = 1;
  p.cost = CostKind::sad;
  p.c_max = 1;
  p.n_square = 15;
  const auto sums = reference::window_sums({left.data(), w, h}, {right.data(), w, h}, p, false);
  const auto r = match(left, right, w, h, 1, p);
  for (size_t i = 0; i < sums.size(); ++i)
    CHECK(r.confidence[i] == confidence_of(static_cast<int>(sums[i]), p.max_sum()));
}

TEST_CASE("oracle 3: the minimum filter never raises a cost") {
  const int w = 60, h = 30;
  const auto left = noise(w * h, 3), right = noise(w * h, 4);
  MatcherParameters p;
  p.disparities = 20;
  p.n_min = 1;
  const auto plain = match(left, right, w, h, 1, p);
  p.n_min = 5;
  const auto filtered = match(left, right, w, h, 1, p);
  bool changed = false;
  for (size_t i = 0; i < plain.confidence.size(); ++i) {
    CHECK(filtered.confidence[i] >= plain.confidence[i]);
    changed = changed || filtered.disparity[i] != plain.disparity[i];
  }
  CHECK(changed);
}

TEST_CASE("oracle 4: confidence is 255 at cost 0, 0 at c_max, and falls between") {
  CHECK(confidence_of(0, 2250) == 255);
  CHECK(confidence_of(2250, 2250) == 0);
  CHECK(confidence_of(1125, 2250) == 128);
  for (int s = 1; s <= 2250; ++s) CHECK(confidence_of(s, 2250) <= confidence_of(s - 1, 2250));
}

TEST_CASE("oracle 5: a shifted random-dot pair gives the shift on every interior pixel, with full confidence") {
  const int w = 220, h = 40, channels = 3;
  for (const int shift : {0, 1, 31, 64, 149})
    for (const auto cost : {CostKind::gradient, CostKind::ssd, CostKind::sad}) {
      const auto left = noise(static_cast<size_t>(w * h * channels), 5);
      auto right = noise(left.size(), 6);
      for (int y = 0; y < h; ++y)
        for (int i = shift * channels; i < w * channels; ++i)
          right[static_cast<size_t>(y * w * channels + i - shift * channels)] =
              left[static_cast<size_t>(y * w * channels + i)];
      MatcherParameters p;
      p.cost = cost;
      const auto r = match(left, right, w, h, channels, p);
      // Interior: window and derivative see shifted pixels only.
      for (int y = 0; y < h; ++y)
        for (int x = shift + 8; x < w - 8; ++x) {
          CAPTURE(x);
          REQUIRE(r.disparity[static_cast<size_t>(y * w + x)] == shift);
          REQUIRE(r.confidence[static_cast<size_t>(y * w + x)] == 255);
        }
    }
}

TEST_CASE("oracle 6: f = 492.8 px, B = 0.24 m, d = 24 px is 4.928 m away") {
  const CameraModel camera{492.8, 1.0, 1.0, 0.24};
  std::vector<int16_t> d{-1, 0, 24, 24, 24, 24, 48, 0, 24};
  const std::vector<uint8_t> image{1, 2, 3, 4, 5, 6, 7, 8, 9};
  std::vector<Point> points(9);
  std::vector<Colour> colours(9);
  const DisparityViews map{{d.data(), 3, 3}, {}};
  REQUIRE(triangulate(map, {image.data(), 3, 3}, camera, 1, points, colours) == 6);
  CHECK(points[0].z == doctest::Approx(4.928));  // pixel (2, 0): right of and above the principal point
  CHECK(points[0].x == doctest::Approx(0.01));
  CHECK(points[0].y == doctest::Approx(-0.01));
  CHECK(colours[0].b == 3);
  CHECK(points[4].z == doctest::Approx(2.464));  // pixel (0, 2)
  CHECK(triangulate(map, {image.data(), 3, 3}, camera, 2, points, colours) == 3);
  CHECK(triangulate(map, {image.data(), 3, 3}, camera, 1, std::span(points).first(2), colours) == 2);
  CHECK(triangulate(map, {image.data(), 3, 3}, CameraModel{}, 1, points, colours) == 0);
}

TEST_CASE("parameters and views that cannot work are refused with name and value") {
  MatcherParameters p;
  p.disparities = 513;
  CHECK(problem(p, 64, 48, 3).value().find("disparities is 513") != std::string::npos);
  p = {};
  p.n_min = 17;
  CHECK(problem(p, 64, 48, 3).value().find("n_min is 17") != std::string::npos);
  p = {};
  p.n_square = 4;
  p.n_min = 3;
  CHECK(problem(p, 64, 48, 3).has_value());
  p = {};
  p.cost = CostKind::sad;
  p.c_max = 255;
  p.n_square = 31;
  CHECK(problem(p, 64, 48, 3).value().find("65534") != std::string::npos);
  CHECK(problem({}, 64, 48, 4).has_value());
  CHECK(problem({}, 0, 48, 3).has_value());
  CHECK_FALSE(problem({}, 1, 1, 1).has_value());
  CHECK_THROWS_AS(make_matcher(64, 48, 2, {}), std::invalid_argument);

  const auto matcher = make_matcher(8, 8, 1, {});
  std::vector<uint8_t> image(64), confidence(64);
  std::vector<int16_t> disparity(64, 77);
  CHECK_FALSE(matcher->match({image.data(), 8, 7}, {image.data(), 8, 8},
                             {{disparity.data(), 8, 8}, {confidence.data(), 8, 8}}));
  CHECK(disparity[0] == 77);
}

TEST_CASE("views with a stride give the result of packed ones") {
  const int w = 30, h = 12;
  const auto left = noise(w * h, 8), right = noise(w * h, 9);
  MatcherParameters p;
  p.disparities = 10;
  const auto packed = match(left, right, w, h, 1, p);
  std::vector<uint8_t> wide_left(static_cast<size_t>(h) * 50, 1), wide_right(wide_left),
      confidence(static_cast<size_t>(h) * 40, 3);
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      wide_left[static_cast<size_t>(y * 50 + x)] = left[static_cast<size_t>(y * w + x)];
      wide_right[static_cast<size_t>(y * 50 + x)] = right[static_cast<size_t>(y * w + x)];
    }
  std::vector<int16_t> disparity(static_cast<size_t>(h) * 33, 99);
  const auto matcher = make_matcher(w, h, 1, p);
  REQUIRE(matcher->match({wide_left.data(), w, h, 1, 50}, {wide_right.data(), w, h, 1, 50},
                         {{disparity.data(), w, h, 1, 33}, {confidence.data(), w, h, 1, 40}}));
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      CHECK(disparity[static_cast<size_t>(y * 33 + x)] == packed.disparity[static_cast<size_t>(y * w + x)]);
      CHECK(confidence[static_cast<size_t>(y * 40 + x)] == packed.confidence[static_cast<size_t>(y * w + x)]);
    }
    for (int x = w; x < 33; ++x) CHECK(disparity[static_cast<size_t>(y * 33 + x)] == 99);
    for (int x = w; x < 40; ++x) CHECK(confidence[static_cast<size_t>(y * 40 + x)] == 3);
  }
}

TEST_CASE("half resolution: means of four, disparities doubled, rejected pixels stay rejected") {
  const std::vector<uint8_t> image{1, 3, 9, 5, 8, 9, 7, 7, 7};
  std::vector<uint8_t> out(1);
  halve({image.data(), 3, 3}, {out.data(), 1, 1});
  CHECK(out[0] == 4);  // mean 4.25
  std::vector<int16_t> d{3, -1};
  std::vector<uint8_t> c{10, 20};
  std::vector<int16_t> d2(10);
  std::vector<uint8_t> c2(10);
  enlarge({{d.data(), 2, 1}, {c.data(), 2, 1}}, {{d2.data(), 5, 2}, {c2.data(), 5, 2}});
  CHECK(d2 == std::vector<int16_t>{6, 6, -1, -1, -1, 6, 6, -1, -1, -1});
  CHECK(c2 == std::vector<uint8_t>{10, 10, 20, 20, 20, 10, 10, 20, 20, 20});
}

TEST_CASE("the score counts missing pixels as bad and leaves hidden ones out") {
  // Pixels 4 and 5 (d = 4) hide pixel 1 (d = 1, lands on 0) and one more that lands beside them; pixel 0 leaves the
  // image.
  const DisparityImage truth{8, 1, {2, 1, 0, 1, 4, 4, 1, 1}};
  CHECK(visible_in_right(truth) == std::vector<uint8_t>{0, 0, 0, 1, 1, 1, 1, 1});
  const DisparityImage found{8, 1, {2, 1, 7, 3, -1, 5, NAN, 1}};
  const StereoScore s = score(found, truth);
  CHECK(s.known == 7);
  CHECK(s.visible == 5);
  CHECK(s.bad_1px_pct == doctest::Approx(100.0 * 3 / 5));  // 3: two off; 4 and 6: missing
  CHECK(s.bad_1px_all_pct == doctest::Approx(100.0 * 3 / 7));
  CHECK(s.density_pct == doctest::Approx(100.0 * 5 / 7));
  CHECK_THROWS_AS(score(DisparityImage{1, 1, {0}}, truth), std::invalid_argument);
}
