// SPDX-License-Identifier: Apache-2.0
// The fast matcher against the slow reference: equal bit for bit, for every cost, odd size and SIMD target.
#include <doctest/doctest.h>
#include <hwy/targets.h>

#include <random>
#include <string>
#include <vector>

#include "nodes/stereo/matcher.hpp"
#include "nodes/stereo/reference.hpp"

using namespace takt;
using namespace takt::stereo;

namespace {

struct Picture {
  int width, height, channels;
  std::vector<uint8_t> pixels;
  ImageView<const uint8_t> view() const { return {pixels.data(), width, height, channels}; }
};

/// Few grey levels now and then, so that ties occur.
Picture random_picture(std::mt19937& random, int width, int height, int channels, int levels) {
  Picture p{width, height, channels, std::vector<uint8_t>(static_cast<size_t>(width * height * channels))};
  std::uniform_int_distribution<int> level(0, levels - 1);
  for (auto& v : p.pixels) v = static_cast<uint8_t>(level(random) * 255 / std::max(1, levels - 1));
  return p;
}

/// The right image: the left one shifted by `shift`, a share of the pixels replaced.
Picture shifted(std::mt19937& random, const Picture& left, int shift, int noise_percent) {
  Picture right = random_picture(random, left.width, left.height, left.channels, 256);
  std::uniform_int_distribution<int> percent(0, 99);
  for (int y = 0; y < left.height; ++y)
    for (int x = shift; x < left.width; ++x)
      if (percent(random) >= noise_percent)
        for (int c = 0; c < left.channels; ++c)
          right.pixels[static_cast<size_t>(((y * left.width) + x - shift) * left.channels + c)] =
              left.view().at(x, y, c);
  return right;
}

/// `room`: disparities that the matcher takes memory for, of which it then searches those of `p`.
void expect_equal(const Picture& left, const Picture& right, const MatcherParameters& p, int room = 0) {
  const auto count = static_cast<size_t>(left.width * left.height);
  std::vector<int16_t> slow(count), fast(count);
  std::vector<uint8_t> slow_confidence(count), fast_confidence(count);
  reference::match(left.view(), right.view(), p, {slow.data(), left.width, left.height},
                   {slow_confidence.data(), left.width, left.height});
  MatcherParameters largest = p;
  largest.disparities = std::max(room, p.disparities);
  Matcher matcher(left.width, left.height, left.channels, largest);
  matcher.limit_search(p.disparities);
  for (int run = 0; run < 2; ++run) {  // the second run finds used scratch memory
    std::fill(fast.begin(), fast.end(), int16_t{-7});
    REQUIRE(matcher.match(left.view(), right.view(), {fast.data(), left.width, left.height},
                          {fast_confidence.data(), left.width, left.height}));
    INFO(matcher.target(), " ", left.width, "x", left.height, "x", left.channels, " D ", p.disparities, " cost ",
         static_cast<int>(p.cost), " c_max ", p.truncation(), " n ", p.n_square, " min ", p.n_min, " unique ",
         p.uniqueness, " lr ", p.left_right_check);
    CHECK(slow == fast);
    CHECK(slow_confidence == fast_confidence);
  }
}

MatcherParameters random_parameters(std::mt19937& random, int largest_disparity) {
  const auto pick = [&](int low, int high) { return std::uniform_int_distribution<int>(low, high)(random); };
  MatcherParameters p;
  p.disparities = pick(1, largest_disparity);
  p.cost = static_cast<CostKind>(pick(0, 2));
  p.n_square = 2 * pick(0, 5) + 1;
  p.n_min = std::min(p.n_square, 2 * pick(0, 3) + 1);
  const int limit = p.cost == CostKind::gradient ? 64 : p.cost == CostKind::ssd ? 225 : 255;
  if (pick(0, 2) > 0) p.c_max = pick(1, limit);
  if (pick(0, 3) == 0) p.min_confidence = pick(1, 255);
  if (pick(0, 2) == 0) p.uniqueness = pick(1, 255);
  if (pick(0, 2) == 0) p.left_right_check = true;
  return p;
}

/// Runs `body` once per SIMD target that this machine and this build have.
template <class Body>
void on_each_target(Body body) {
  for (const int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    body();
  }
  hwy::SetSupportedTargetsForTest(0);
}

}  // namespace

TEST_CASE("random pairs, sizes, costs: equal to the reference on every SIMD target") {
  int targets = 0;
  on_each_target([&] {
    ++targets;
    std::mt19937 random(7);
    for (int round = 0; round < 60; ++round) {
      const auto pick = [&](int low, int high) { return std::uniform_int_distribution<int>(low, high)(random); };
      const int channels = pick(0, 1) ? 3 : 1;
      const Picture left = random_picture(random, pick(1, 45), pick(1, 33), channels, round % 3 ? 256 : 3);
      const Picture right = shifted(random, left, pick(0, left.width - 1), pick(0, 100));
      expect_equal(left, right, random_parameters(random, 60));
    }
  });
  CHECK(targets >= 1);
}

TEST_CASE("a search limited after construction: equal to the reference of the smaller range") {
  on_each_target([&] {
    std::mt19937 random(19);
    for (int round = 0; round < 30; ++round) {
      const auto pick = [&](int low, int high) { return std::uniform_int_distribution<int>(low, high)(random); };
      const Picture left = random_picture(random, pick(1, 45), pick(1, 33), 1, 256);
      const Picture right = shifted(random, left, pick(0, left.width - 1), pick(0, 100));
      expect_equal(left, right, random_parameters(random, 200), pick(1, 512));
    }
  });
}

TEST_CASE("search ranges of several register blocks and strips of columns: equal to the reference") {
  on_each_target([&] {
    std::mt19937 random(11);
    for (const int disparities : {129, 150, 193, 300, 512})
      for (const auto cost : {CostKind::gradient, CostKind::ssd, CostKind::sad}) {
        const Picture left = random_picture(random, 347, 3, 3, 256);
        MatcherParameters p;
        p.disparities = disparities;
        p.cost = cost;
        p.n_square = 5;
        p.n_min = 3;
        expect_equal(left, shifted(random, left, disparities / 2, 10), p);
        p.uniqueness = 20;
        p.n_square = 3;
        if (disparities == 193) expect_equal(left, shifted(random, left, disparities / 2, 30), p);
      }
  });
}

TEST_CASE("window of 15, minimum filter of 5, the defaults: equal to the reference") {
  std::mt19937 random(13);
  MatcherParameters p;
  p.disparities = 40;
  for (const auto cost : {CostKind::gradient, CostKind::ssd, CostKind::sad})
    for (const int channels : {1, 3}) {
      p.cost = cost;
      const Picture left = random_picture(random, 71, 31, channels, 256);
      expect_equal(left, shifted(random, left, 17, 5), p);
    }
}

TEST_CASE("flat images, where every disparity ties: the smallest wins") {
  const Picture flat{33, 9, 1, std::vector<uint8_t>(33 * 9, 90)};
  MatcherParameters p;
  p.disparities = 20;
  expect_equal(flat, flat, p);
  p.uniqueness = 1;  // and is rejected once ambiguity counts
  expect_equal(flat, flat, p);
}
