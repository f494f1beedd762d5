// SPDX-License-Identifier: Apache-2.0
// Pairs whose right image is moved up or down, and what the monitor behind the matcher says of them.
#pragma once
#include <doctest/doctest.h>

#include <opencv2/imgproc.hpp>
#include <optional>
#include <string>
#include <vector>

#include "nodes/stereo/matcher.hpp"
#include "nodes/stereo/rectification_monitor.hpp"

namespace takt::test {

using namespace stereo;

struct NamedPair {
  std::string name;
  cv::Mat left, right;
  int disparities;
};

/// What the monitor says after three seconds at 15 Hz with the right image `down` px lower (cubic).
inline std::optional<double> row_error_px(const NamedPair& scene, double down) {
  cv::Mat moved;
  cv::warpAffine(scene.right, moved, cv::Matx23d(1, 0, 0, 0, 1, down), scene.right.size(), cv::INTER_CUBIC,
                 cv::BORDER_REPLICATE);
  const int w = scene.left.cols, h = scene.left.rows;
  MatcherParameters p;
  p.disparities = scene.disparities;
  std::vector<int16_t> disparity(scene.left.total());
  std::vector<uint8_t> confidence(scene.left.total());
  const ImageView<const uint8_t> left(scene.left.data, w, h, 3), right(moved.data, w, h, 3);
  REQUIRE(make_matcher(w, h, 3, p)->match(left, right, {{disparity.data(), w, h}, {confidence.data(), w, h}}));
  RectificationMonitor monitor(w, h, p.disparities);
  for (int i = 0; i < 45; ++i) monitor.observe(left, right, {disparity.data(), w, h});
  return monitor.row_error_px();
}

inline void expect_told(const NamedPair& scene) {
  const auto good = row_error_px(scene, 0);
  REQUIRE(good);
  CAPTURE(scene.name);
  CHECK(*good < RowErrorAlarm::kOver);
  for (const double down : {1.5, 2.0, 4.0, 8.0, -4.0, -8.0}) {
    CAPTURE(down);
    const auto error = row_error_px(scene, down);
    REQUIRE(error);
    MESSAGE(scene.name, ", moved by ", down, " px: ", *error);
    CHECK(*error > RowErrorAlarm::kWrong);
  }
}

}  // namespace takt::test
