// SPDX-License-Identifier: Apache-2.0
// Half resolution on pairs with ground truth.
#include "nodes/stereo/half_resolution.hpp"

#include <doctest/doctest.h>

#include <opencv2/imgcodecs.hpp>
#include <string>

#include "tests/recorded/recording.hpp"
#include "tests/unit/stereo/scored_result.hpp"

using namespace takt;
using namespace takt::stereo;
using takt::test::recording;
using takt::test::ScoredResult;

TEST_CASE("level 1 on recorded pairs with ground truth") {
  struct Recording {
    const char *folder, *left, *right, *truth;
    int disparities;
    double scale, most_bad_pct;  // measured 7.7, 16.5 and 10.0
  };
  for (const Recording& r : {Recording{"stereo/tsukuba", "im3.png", "im4.png", "disp3.pgm", 16, 16, 8.1},
                             Recording{"stereo/teddy", "im2.png", "im6.png", "disp2.png", 64, 4, 16.9},
                             Recording{"stereo/aloe", "aloeL.jpg", "aloeR.jpg", "aloeGT.png", 216, 1, 10.4}}) {
    const auto folder = recording(r.folder);
    const cv::Mat left = cv::imread((folder / r.left).string()), right = cv::imread((folder / r.right).string());
    const cv::Mat truth_image = cv::imread((folder / r.truth).string(), cv::IMREAD_GRAYSCALE);
    REQUIRE(left.size() == truth_image.size());
    const DisparityImage truth =
        ground_truth(ImageView<const uint8_t>(truth_image.data, truth_image.cols, truth_image.rows), r.scale);
    MatcherParameters p;
    p.disparities = r.disparities;
    HalfMatcher matcher(left.cols, left.rows, 3, p);
    const ScoredResult result =
        test::run(matcher, {left.data, left.cols, left.rows, 3}, {right.data, left.cols, left.rows, 3}, truth);
    MESSAGE(std::string(r.folder), ": ", result.score.bad_1px_pct, " % bad");
    CHECK(result.score.bad_1px_pct <= r.most_bad_pct);
  }
}
