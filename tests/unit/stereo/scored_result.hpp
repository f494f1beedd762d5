// SPDX-License-Identifier: Apache-2.0
// A matcher's result on one pair, with its errors.
#pragma once
#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <vector>

#include "nodes/stereo/evaluate.hpp"
#include "nodes/stereo/matcher.hpp"

namespace takt::test {

using namespace stereo;

struct ScoredResult {
  StereoScore score;
  double mean_error_px = 0;
  std::vector<int16_t> disparity;
  std::vector<uint8_t> confidence;
};

inline ScoredResult run(Matcher& matcher, ImageView<const uint8_t> left, ImageView<const uint8_t> right,
                        const DisparityImage& truth) {
  ScoredResult r;
  r.disparity.resize(truth.pixels.size());
  r.confidence.resize(truth.pixels.size());
  const ImageView<int16_t> disparity(r.disparity.data(), left.width, left.height);
  REQUIRE(matcher.match(left, right, {disparity, {r.confidence.data(), left.width, left.height}}));
  r.score = score(to_disparity_image(disparity), truth);
  const auto visible = visible_in_right(truth);
  double sum = 0;
  for (size_t i = 0; i < visible.size(); ++i)
    if (visible[i]) sum += std::abs(static_cast<double>(r.disparity[i]) - static_cast<double>(truth.pixels[i]));
  r.mean_error_px = sum / static_cast<double>(r.score.visible);
  return r;
}

}  // namespace takt::test
