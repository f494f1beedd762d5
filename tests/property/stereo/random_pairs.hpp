// SPDX-License-Identifier: Apache-2.0
// Random pairs and parameters, and a matcher's output beside the expected one.
#pragma once
#include <doctest/doctest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "nodes/stereo/matcher.hpp"

namespace takt::test {

using namespace takt::stereo;

struct Picture {
  int width, height, channels;
  std::vector<uint8_t> pixels;
  ImageView<const uint8_t> view() const { return {pixels.data(), width, height, channels}; }
};

/// Few grey levels now and then, so that ties occur.
inline Picture random_picture(std::mt19937& random, int width, int height, int channels, int levels) {
  Picture p{width, height, channels, std::vector<uint8_t>(static_cast<size_t>(width * height * channels))};
  std::uniform_int_distribution<int> level(0, levels - 1);
  for (auto& v : p.pixels) v = static_cast<uint8_t>(level(random) * 255 / std::max(1, levels - 1));
  return p;
}

/// The right image: the left one shifted by `shift`, a share of the pixels replaced.
inline Picture shifted(std::mt19937& random, const Picture& left, int shift, int noise_percent) {
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

struct Output {
  std::vector<int16_t> disparity;
  std::vector<uint8_t> confidence, fraction;
  explicit Output(const Picture& p)
      : disparity(static_cast<size_t>(p.width * p.height), -7),
        confidence(disparity.size()),
        fraction(disparity.size()) {}
  DisparityViews views(const Picture& p) {
    return {{disparity.data(), p.width, p.height},
            {confidence.data(), p.width, p.height},
            {fraction.data(), p.width, p.height}};
  }
  /// Those rows of all three, one behind another.
  std::vector<int> rows(int first, int last, int width) const {
    std::vector<int> all;
    const auto add = [&](const auto& image) {
      all.insert(all.end(), image.begin() + first * width, image.begin() + last * width);
    };
    add(disparity);
    add(confidence);
    add(fraction);
    return all;
  }
  bool operator==(const Output&) const = default;
};

inline void expect_equal(Matcher& matcher, const Picture& left, const Picture& right, const MatcherParameters& p,
                         const Output& expected) {
  for (int run = 0; run < 2; ++run) {  // the second run finds used scratch memory
    Output out(left);
    REQUIRE(matcher.match(left.view(), right.view(), out.views(left)));
    INFO(matcher.target(), " ", left.width, "x", left.height, "x", left.channels, " D ", p.disparities, " cost ",
         static_cast<int>(p.cost), " c_max ", p.truncation(), " n ", p.n_square, " min ", p.n_min, " selection ",
         static_cast<int>(p.selection), " p ", p.step_once(), "/", p.step_twice(), " unique ", p.uniqueness, " lr ",
         p.left_right_check, " median ", p.median, " subpixel ", p.subpixel);
    CHECK(expected.disparity == out.disparity);
    CHECK(expected.confidence == out.confidence);
    CHECK(expected.fraction == out.fraction);
  }
}

inline MatcherParameters random_parameters(std::mt19937& random, int largest_disparity) {
  const auto pick = [&](int low, int high) { return std::uniform_int_distribution<int>(low, high)(random); };
  MatcherParameters p;
  p.disparities = pick(1, largest_disparity);
  p.cost = static_cast<CostKind>(pick(0, 3));
  p.n_square = 2 * pick(0, 5) + 1;
  p.n_min = std::min(p.n_square, 2 * pick(0, 3) + 1);
  constexpr int kLargest[] = {64, 225, 255, 48};
  const int limit = kLargest[static_cast<int>(p.cost)];
  if (pick(0, 2) > 0) p.c_max = pick(1, limit);
  if (pick(0, 3) == 0) p.min_confidence = pick(1, 255);
  if (pick(0, 2) == 0) p.uniqueness = pick(1, 255);
  if (pick(0, 2) == 0) p.left_right_check = true;
  if (pick(0, 2) == 0) p.subpixel = true;
  if (pick(0, 2) == 0) p.median = true;
  return p;
}

}  // namespace takt::test
