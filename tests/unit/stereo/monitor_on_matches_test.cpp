// SPDX-License-Identifier: Apache-2.0
// The monitor behind the matcher, as in the node, on pairs whose right image was moved up or down: made and recorded
// ones.
#include <doctest/doctest.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "nodes/stereo/generated_pair.hpp"
#include "nodes/stereo/matcher.hpp"
#include "nodes/stereo/rectification_monitor.hpp"
#include "tests/test_data.hpp"

using namespace takt;
using namespace takt::stereo;

namespace {

struct NamedPair {
  std::string name;
  cv::Mat left, right;
  int disparities;
};

/// What the monitor says after three seconds at 15 Hz with the right image `down` px lower (cubic).
std::optional<double> row_error_px(const NamedPair& scene, double down) {
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

void expect_told(const NamedPair& scene) {
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

}  // namespace

TEST_CASE("a made pair whose rows differ by more than a pixel is told as wrong, however much they differ") {
  const GeneratedPair pair = generate_pair(640, 480, 64, 25, 2, 3);
  const auto image = [&](const std::vector<uint8_t>& pixels) {
    return cv::Mat(pair.height, pair.width, CV_8UC3, const_cast<uint8_t*>(pixels.data()));
  };
  expect_told({"made", image(pair.left), image(pair.right), 64});
}

TEST_CASE("recorded pairs whose rows differ by more than a pixel are told as wrong, however much they differ") {
  struct Recording {
    const char *folder, *left, *right;
    int disparities;
    double size;
  };
  for (const Recording& r : {Recording{"stereo/tsukuba", "im3.png", "im4.png", 16, 1},
                             Recording{"stereo/teddy", "im2.png", "im6.png", 64, 1},
                             Recording{"stereo/aloe", "aloeL.jpg", "aloeR.jpg", 112, 0.5}}) {
    const auto folder = takt::test::recording(r.folder);
    if (!folder) return;
    NamedPair scene{r.folder, cv::imread((*folder / r.left).string()), cv::imread((*folder / r.right).string()),
                    r.disparities};
    for (cv::Mat* image : {&scene.left, &scene.right})
      cv::resize(*image, *image, {}, r.size, r.size, r.size < 1 ? cv::INTER_AREA : cv::INTER_LINEAR);
    expect_told(scene);
  }
}
