// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>
#include <utility>
#include <vector>

#include "nodes/ego_motion/block_search.hpp"
#include "nodes/ego_motion/corners.hpp"
#include "nodes/ego_motion/flow_filter.hpp"
#include "nodes/ego_motion/refine.hpp"
#include "tests/on_each_target.hpp"
#include "tests/property_scale.hpp"

using namespace takt::ego_motion;
using takt::test::on_each_target;

namespace {

/// Noise, smoothed `passes` times so that it has structure on several scales.
Plane noise(std::mt19937& random, int width, int height, int passes) {
  Plane image(width, height), copy(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) image.row(y)[x] = static_cast<uint8_t>(random() & 255);
  for (int pass = 0; pass < passes; ++pass) {
    for (int y = 0; y < height; ++y) std::copy_n(image.row(y), width, copy.row(y));
    for (int y = 1; y < height - 1; ++y)
      for (int x = 1; x < width - 1; ++x) {
        int sum = 0;
        for (int v = -1; v <= 1; ++v)
          for (int u = -1; u <= 1; ++u) sum += copy.row(y + v)[x + u];
        image.row(y)[x] = static_cast<uint8_t>(sum / 9);
      }
  }
  return image;
}

int between(std::mt19937& random, int low, int high) { return std::uniform_int_distribution<int>(low, high)(random); }

}  // namespace

Level with_means(Plane image) {
  Level level(image.width(), image.height());
  level.image = std::move(image);
  level.fill_mean();
  return level;
}

TEST_CASE(
    "block_search equals three nested loops over pixels on every SIMD target, with equal brightness or as it is") {
  on_each_target([] {
    std::mt19937 random(takt::test::seed(1));
    for (int round = 0; round < takt::test::rounds(300); ++round) {
      const int width = between(random, 33, 90), height = between(random, 33, 70), half = between(random, 1, 7);
      Level a(width, height), b(width, height);
      a.image = noise(random, width, height, round % 3);
      b.image = noise(random, width, height, round % 3);
      if (round % 2 == 0) a = with_means(a.image), b = with_means(b.image);
      const int x = between(random, half, width - 1 - half), y = between(random, half, height - 1 - half);
      const int cx = between(random, -5, width + 5), cy = between(random, -5, height + 5);
      const int rx = between(random, 0, 20), ry = between(random, 0, 12);
      Patch patch;
      patch.take(a, x, y, half);
      const BlockMatch fast = block_search(patch, b, cx, cy, rx, ry);
      const BlockMatch slow = block_search_reference(a, x, y, half, b, cx, cy, rx, ry);
      CHECK(fast.cost == slow.cost);
      CHECK(fast.x == slow.x);
      CHECK(fast.y == slow.y);
      if (slow.found()) CHECK(sad(patch, b, slow.x, slow.y) == slow.cost);
    }
  });
}

TEST_CASE("the corner response equals the double loop bit by bit on every SIMD target") {
  on_each_target([] {
    std::mt19937 random(takt::test::seed(2));
    for (int round = 0; round < takt::test::rounds(20); ++round) {
      const int width = between(random, 20, 150), height = between(random, 20, 60);
      const Plane image = noise(random, width, height, round % 4);
      CornerDetector detector(width, height, {});
      detector.detect(image);
      bool equal = true;
      for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
          const bool border = x < 2 || y < 2 || x >= width - 2 || y >= height - 2;
          equal &= detector.response().at(x, y) == (border ? 0 : CornerDetector::response_reference(image, x, y));
        }
      CHECK(equal);
    }
  });
}

TEST_CASE("corners are the same on every SIMD target, the best of a quadratic search") {
  on_each_target([] {
    std::mt19937 random(takt::test::seed(13));
    for (int round = 0; round < takt::test::rounds(20); ++round) {
      const int width = between(random, 64, 200), height = between(random, 64, 150);
      const Plane image = noise(random, width, height, round % 3);
      CornerParameters p;
      p.maximum = between(random, 12, 300);
      p.distance_px = between(random, 1, 9);
      p.tile_px = between(random, 16, 300);
      p.margin_px = between(random, 3, 12);
      CornerDetector detector(width, height, p);
      const auto fast = detector.detect(image);
      const auto slow = CornerDetector::select_reference(detector.response(), p, {});
      REQUIRE(fast.size() == slow.size());
      for (size_t i = 0; i < slow.size(); ++i) {
        CHECK(fast[i].x == slow[i].x);
        CHECK(fast[i].y == slow[i].y);
      }
    }
  });
}

TEST_CASE("corners keep their distance, their margin and the mask, strongest first") {
  std::mt19937 random(takt::test::seed(3));
  for (int round = 0; round < takt::test::rounds(20); ++round) {
    const int width = between(random, 64, 200), height = between(random, 64, 150);
    const Plane image = noise(random, width, height, 2);
    CornerParameters p;
    p.maximum = between(random, 12, 300);
    p.distance_px = between(random, 1, 9);
    p.tile_px = between(random, 16, 300);
    std::vector<int16_t> mask(static_cast<size_t>(width * height));
    for (auto& m : mask) m = static_cast<int16_t>(random() % 3) > 0 ? 5 : -1;
    CornerDetector detector(width, height, p);
    const auto corners = detector.detect(image, {mask.data(), width, height});
    CHECK(!corners.empty());
    CHECK(corners.size() <= static_cast<size_t>(p.maximum));
    const auto strength = [&](const Corner& c) { return detector.response().at(c.x, c.y); };
    bool good = true;
    for (size_t i = 0; i < corners.size(); ++i) {
      const Corner& c = corners[i];
      good &= c.x >= p.margin_px && c.y >= p.margin_px && c.x < width - p.margin_px && c.y < height - p.margin_px;
      good &= mask[static_cast<size_t>(c.y * width + c.x)] >= 0;
      good &= i == 0 || strength(corners[i - 1]) >= strength(c);
      for (size_t k = 0; k < i; ++k)
        good &= std::max(std::abs(corners[k].x - c.x), std::abs(corners[k].y - c.y)) >= p.distance_px;
    }
    CHECK(good);
  }
}

TEST_CASE("the flow filter decides like the quadratic one") {
  std::mt19937 random(takt::test::seed(4));
  for (int round = 0; round < takt::test::rounds(100); ++round) {
    const int width = between(random, 64, 400), height = between(random, 64, 300);
    FlowFilterParameters p{static_cast<double>(between(random, 2, 60)), 0.5 * between(random, 1, 10),
                           between(random, 1, 6)};
    std::vector<Flow> flows(static_cast<size_t>(between(random, 0, 300)));
    for (Flow& f : flows)
      f = {static_cast<float>(between(random, 0, width - 1)), static_cast<float>(between(random, 0, height - 1)),
           0.25f * static_cast<float>(between(random, -20, 20)), 0.25f * static_cast<float>(between(random, -20, 20))};
    std::vector<uint8_t> fast(flows.size(), 7), slow(flows.size(), 8);
    FlowFilter(width, height, flows.size(), p).apply(flows, fast);
    FlowFilter::apply_reference(flows, p, slow);
    CHECK(fast == slow);
  }
}

TEST_CASE("the pyramid halves by rounded means and knows the mean around each pixel, on every SIMD target") {
  on_each_target([] {
    std::mt19937 random(takt::test::seed(5));
    const int width = between(random, 64, 180), height = between(random, 64, 100);
    const Plane image = noise(random, width, height, 0);
    Pyramid pyramid(width, height, 3);
    pyramid.build(image.view(), true);
    for (int l = 1; l < 3; ++l) {
      const Plane &fine = pyramid.level(l - 1).image, &coarse = pyramid.level(l).image;
      CHECK(coarse.width() == fine.width() / 2);
      bool equal = true;
      for (int y = 0; y < coarse.height(); ++y)
        for (int x = 0; x < coarse.width(); ++x) {
          int sum = 2;
          for (int v = 0; v < 2; ++v)
            for (int u = 0; u < 2; ++u) sum += fine.row(2 * y + v)[2 * x + u];
          equal &= coarse.row(y)[x] == sum / 4;
        }
      CHECK(equal);
    }
    for (int l = 0; l < 3; ++l) {
      const Plane &of = pyramid.level(l).image, &mean = pyramid.level(l).mean;
      bool equal = true;
      for (int y = 0; y < of.height(); ++y)
        for (int x = 0; x < of.width(); ++x) {
          const int cx = std::clamp(x, 4, of.width() - 4), cy = std::clamp(y, 4, of.height() - 4);
          int sum = 32;
          for (int v = cy - 4; v < cy + 4; ++v)
            for (int u = cx - 4; u < cx + 4; ++u) sum += of.row(v)[u];
          equal &= mean.row(y)[x] == sum / 64;
        }
      CHECK(equal);
    }
  });
}

TEST_CASE("sub-pixel refinement equals loops over pixels bit by bit on every SIMD target") {
  on_each_target([] {
    std::mt19937 random(takt::test::seed(12));
    for (int round = 0; round < takt::test::rounds(200); ++round) {
      const int half = between(random, 1, 7);
      const Plane a = noise(random, 60, 50, round % 4), b = round % 5 == 0 ? a : noise(random, 60, 50, round % 4);
      const double x = between(random, 4, 55) + 0.125 * between(random, 0, 7);
      const double y = between(random, 4, 45) + (round % 2 ? 0.3 : 0.0);
      RefinePatch fast, slow(refine_references());
      const bool taken = fast.take(a, x, y, half);
      CHECK(taken == slow.take(a, x, y, half));
      if (!taken) continue;
      const auto rows = static_cast<size_t>(2 * half + 1) * sizeof fast.samples().value[0];
      CHECK(std::memcmp(fast.samples().value, slow.samples().value, rows) == 0);
      for (const bool row : {false, true}) {
        const SubPixel f = row ? fast.refine_in_row(b, x + 0.4, y, 2) : fast.refine(b, x + 0.4, y - 0.3, 2);
        const SubPixel s = row ? slow.refine_in_row(b, x + 0.4, y, 2) : slow.refine(b, x + 0.4, y - 0.3, 2);
        CHECK(f.converged == s.converged);
        CHECK(f.x == s.x);
        CHECK(f.y == s.y);
      }
    }
  });
}

TEST_CASE(
    "sub-pixel refinement finds a shift of a smooth image to 0.05 px, mostly 0.03, whatever gain and offset of the "
    "brightness") {
  const auto pattern = [](double x, double y) {
    return 110 + 30 * std::sin(0.45 * x + 0.2 * y) + 30 * std::sin(0.35 * y - 0.15 * x) + 20 * std::sin(0.3 * x);
  };
  std::mt19937 random(takt::test::seed(6));
  const int rounds = takt::test::rounds(50);
  int far = 0;
  for (int round = 0; round < rounds; ++round) {
    const double sx = 0.01 * between(random, -90, 90), sy = 0.01 * between(random, -90, 90);
    // Up to the white of the darkest and brightest pixel: what is cut off there is no change of brightness.
    const double gain = 0.01 * between(random, 70, 140), darkest = 30 * gain, brightest = 190 * gain;
    const double offset = between(random, static_cast<int>(std::ceil(-darkest)), static_cast<int>(255 - brightest));
    Plane a(60, 60), b(60, 60);
    for (int y = 0; y < 60; ++y)
      for (int x = 0; x < 60; ++x) {
        a.row(y)[x] = static_cast<uint8_t>(std::lround(pattern(x, y)));
        b.row(y)[x] = static_cast<uint8_t>(std::clamp(std::lround(gain * pattern(x - sx, y - sy) + offset), 0L, 255L));
      }
    RefinePatch patch;
    REQUIRE(patch.take(a, 30, 30, 5));
    const SubPixel at = patch.refine(b, 30, 30, 1.5);
    CHECK(at.converged);
    const double off = std::max(std::abs(at.x - 30 - sx), std::abs(at.y - 30 - sy));
    CHECK(off < 0.05);
    far += off >= 0.03 ? 1 : 0;
  }
  CHECK(far <= 2 + rounds / 10);  // 2 % of them in 60,000 rounds
  RefinePatch patch;
  CHECK_FALSE(patch.take(Plane(60, 60), 3, 30, 5));
  REQUIRE(patch.take(Plane(60, 60), 30, 30, 5));
  CHECK_FALSE(patch.refine(Plane(60, 60), 30, 30, 1.5).converged);  // no texture
}
