// SPDX-License-Identifier: Apache-2.0
#include <opencv2/imgcodecs.hpp>

#include "tests/property/stereo/equal_on_each_target.hpp"
#include "tests/recorded/recording.hpp"

using namespace takt;
using namespace takt::stereo;
using namespace takt::test;

TEST_CASE("a piece of a recorded pair, the defaults and the quality matcher: equal to the reference") {
  const auto folder = recording("stereo/teddy");
  const cv::Rect piece(120, 150, 250, 41);
  const auto read = [&](const char* name) {
    const cv::Mat image = cv::imread((folder / name).string())(piece).clone();
    return Picture{piece.width, piece.height, 3, {image.data, image.data + image.total() * 3}};
  };
  const Picture left = read("im2.png"), right = read("im6.png");
  MatcherParameters p;
  p.disparities = 64;
  expect_equal_on_each_target(left, right, p);
  expect_equal_on_each_target(left, right, quality_of(64));
}
