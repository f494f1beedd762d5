// SPDX-License-Identifier: Apache-2.0
// Dense disparity at 640x480 with 150 disparities on one thread, against OpenCV's block matcher and its fastest
// semi-global matcher. The scene is made here: random texture on a slanted ground and three boxes.
#include <algorithm>
#include <cstdio>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <random>

#include "bench/suite.hpp"
#include "bench/suites/hops.hpp"
#include "nodes/stereo/matcher.hpp"

namespace takt::bench {

std::vector<Row> run_stereo(const Options& options);

namespace {

constexpr int kWidth = 640, kHeight = 480, kDisparities = 150;

int true_disparity(int x, int y) {
  if (x > 100 && x < 220 && y > 80 && y < 300) return 90;
  if (x > 300 && x < 420 && y > 150 && y < 260) return 60;
  if (x > 460 && x < 600 && y > 60 && y < 400) return 120;
  return 10 + y * 60 / kHeight;
}

struct Scene {
  cv::Mat left = cv::Mat(kHeight, kWidth, CV_8UC3), right = left.clone(), left_grey, right_grey;
  Scene() {
    std::mt19937 random(1);
    for (auto at = right.begin<cv::Vec3b>(); at != right.end<cv::Vec3b>(); ++at)
      for (int c = 0; c < 3; ++c) (*at)[c] = static_cast<uint8_t>(random());
    cv::GaussianBlur(right, right, {3, 3}, 0);
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        left.at<cv::Vec3b>(y, x) = right.at<cv::Vec3b>(y, std::max(0, x - true_disparity(x, y)));
    cv::cvtColor(left, left_grey, cv::COLOR_BGR2GRAY);
    cv::cvtColor(right, right_grey, cv::COLOR_BGR2GRAY);
  }
};

template <class Work>
double milliseconds(Work work) {
  const int64_t begin = now_ns();
  work();
  return static_cast<double>(now_ns() - begin) * 1e-6;
}

template <class A, class B>
void compare(std::vector<Row>& rows, const std::string& what, const std::string& reference, const std::string& granted,
             int rounds, A a, B b) {
  std::fprintf(stderr, "stereo: %s against %s\n", what.c_str(), reference.c_str());
  Row row{"stereo/" + what + "/640x480x150", "ms", 0, {}, {}, {}, {}, granted};
  Pairs pairs;
  a();
  b();
  pairs.add_a(milliseconds(a));
  for (int i = 0; i < rounds; ++i) {
    const double ms = milliseconds(b);
    pairs.add_b(ms);
    row.samples.add(ms);
    pairs.add_a(milliseconds(a));
  }
  add_pair(rows, std::move(row), reference, pairs);
}

}  // namespace

std::vector<Row> run_stereo(const Options& options) {
  cv::setNumThreads(1);
  const int rounds = options.rounds_or(30);
  const Scene scene;
  stereo::MatcherParameters parameters;
  parameters.disparities = kDisparities;
  const auto colour = stereo::make_matcher(kWidth, kHeight, 3, parameters),
             grey = stereo::make_matcher(kWidth, kHeight, 1, parameters);
  cv::Mat disparity(kHeight, kWidth, CV_16S), confidence(kHeight, kWidth, CV_8U), theirs;
  const auto view = [](const cv::Mat& m) { return ImageView<const uint8_t>{m.data, m.cols, m.rows, m.channels()}; };
  const ImageView<int16_t> out{disparity.ptr<int16_t>(), kWidth, kHeight};
  const ImageView<uint8_t> sure{confidence.data, kWidth, kHeight};
  const auto run = [&](stereo::Matcher& matcher, const cv::Mat& left, const cv::Mat& right) {
    if (!matcher.match(view(left), view(right), {out, sure})) throw CannotRun("the matcher refused its input");
  };
  // OpenCV wants a multiple of 16.
  const auto block = cv::StereoBM::create((kDisparities + 15) / 16 * 16, parameters.n_square);
  const auto global = cv::StereoSGBM::create(0, (kDisparities + 15) / 16 * 16, 5, 200, 800, 1, 63, 10, 100, 2,
                                             cv::StereoSGBM::MODE_SGBM_3WAY);
  const auto with_block = [&] { block->compute(scene.left_grey, scene.right_grey, theirs); };
  const auto with_global = [&] { global->compute(scene.left, scene.right, theirs); };
  const std::string granted = std::string("one thread, ") + colour->target();
  std::vector<Row> rows;
  compare(rows, "match_grey", "cv::StereoBM", granted, rounds, with_block,
          [&] { run(*grey, scene.left_grey, scene.right_grey); });
  compare(rows, "match_colour", "cv::StereoBM on grey", granted, rounds, with_block,
          [&] { run(*colour, scene.left, scene.right); });
  compare(rows, "match_colour_to_sgbm", "cv::StereoSGBM 3-way", granted, rounds, with_global,
          [&] { run(*colour, scene.left, scene.right); });
  return rows;
}

}  // namespace takt::bench
