// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <opencv2/imgcodecs.hpp>

#include "nodes/sift/sift_match.hpp"
#include "tests/recorded/recording.hpp"

using namespace takt::sift;

TEST_CASE("SIFT finds the recorded box in its scene") {
  Matcher matcher;
  const auto features = [&](const char* file) {
    return matcher.features(cv::imread(takt::test::recording(file).string(), cv::IMREAD_GRAYSCALE));
  };
  const Match match = matcher.match(features("objects/box/box.png"), features("objects/box/box_in_scene.png"));
  CHECK(match.found);
  CHECK(match.inliers > 30);
}
