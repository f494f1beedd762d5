// SPDX-License-Identifier: Apache-2.0
// Dense disparity at 640x480 with 150 disparities, against OpenCV's block matcher and its fastest semi-global matcher,
// on a generated pair.
#include <hwy/targets.h>

#include <algorithm>
#include <cstdio>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <tuple>

#include "bench/suite.hpp"
#include "bench/suites/hops.hpp"
#include "bench/two_cores.hpp"
#include "nodes/stereo/band_matcher.hpp"
#include "nodes/stereo/generated_pair.hpp"
#include "nodes/stereo/half_resolution.hpp"
#include "nodes/stereo/matcher.hpp"

namespace takt::bench {

std::vector<Row> run_stereo(const Options& options);

namespace {

constexpr int kWidth = 640, kHeight = 480, kDisparities = 150;

struct Scene {
  stereo::GeneratedPair pair = stereo::generate_pair(kWidth, kHeight, kDisparities, 30, 2, 1);
  cv::Mat left{kHeight, kWidth, CV_8UC3, pair.left.data()}, right{kHeight, kWidth, CV_8UC3, pair.right.data()};
  cv::Mat left_grey, right_grey;
  Scene() {
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

/// A matcher for the best instructions that an AVX2 machine has.
std::unique_ptr<stereo::Matcher> avx2_matcher(int channels, const stereo::MatcherParameters& parameters) {
  hwy::DisableTargets(HWY_AVX2 - 1);  // a better target has a lower bit
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  auto matcher = stereo::make_matcher(kWidth, kHeight, channels, parameters);
  hwy::DisableTargets(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  return matcher;
}

/// Rounds of the reference a and of b, one after the other in one process.
template <class A, class B>
void compare(std::vector<Row>& rows, const std::string& name, const std::string& reference, const std::string& granted,
             int rounds, A a, B b) {
  std::fprintf(stderr, "%s against %s\n", name.c_str(), reference.c_str());
  Row row{name, "ms", 0, {}, {}, {}, {}, granted};
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

/// Beside what the original's figure says: a constant, so there are no rounds of it.
void add_original(std::vector<Row>& rows, const std::string& name) {
  constexpr double kOriginal_ms = 60;
  Row row = rows.front();
  row.name = name;
  row.reference = "the original's graphics processors (thesis)";
  row.value = *row.samples.quantile(0.5);
  row.reference_value = kOriginal_ms;
  row.ratio = row.value / kOriginal_ms;
  rows.push_back(std::move(row));
}

cv::Mat padded(const cv::Mat& image, int left) {
  cv::Mat out;
  cv::copyMakeBorder(image, out, 0, 0, left, 0, cv::BORDER_REPLICATE);
  return out;
}

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
  const stereo::DisparityViews out{{disparity.ptr<int16_t>(), kWidth, kHeight}, {confidence.data, kWidth, kHeight}};
  const auto with = [&](stereo::Matcher& matcher, const cv::Mat& left, const cv::Mat& right) {
    return [&] {
      if (!matcher.match(view(left), view(right), out)) throw CannotRun("the matcher refused its input");
    };
  };
  // OpenCV wants a multiple of 16; 63 is its sample's pre-filter. No rejection, so that all search alike; its matchers
  // leave as many columns out.
  constexpr int kRange = (kDisparities + 15) / 16 * 16;
  const auto block = cv::StereoBM::create(kRange, parameters.n_square);
  block->setTextureThreshold(0);
  block->setUniquenessRatio(0);
  const auto global = cv::StereoSGBM::create(0, kRange, 5, 600, 2400, 1, 63, 0, 0, 0, cv::StereoSGBM::MODE_SGBM_3WAY);
  const auto with_block = [&] { block->compute(scene.left_grey, scene.right_grey, theirs); };
  const auto with_global = [&] { global->compute(scene.left, scene.right, theirs); };
  const cv::Mat wide_left = padded(scene.left, kRange), wide_right = padded(scene.right, kRange);
  const auto with_padded_global = [&] { global->compute(wide_left, wide_right, theirs); };
  auto quality_parameters = stereo::MatcherParameters::quality();
  quality_parameters.disparities = kDisparities;
  const auto quality = stereo::make_matcher(kWidth, kHeight, 3, quality_parameters);

  const std::string one = std::string("one thread, ") + colour->target();
  const std::string name = "stereo/640x480x150";
  std::vector<Row> rows;
  compare(rows, name + "/1-thread", "cv::StereoBM unfiltered, on grey", one, rounds, with_block,
          with(*colour, scene.left, scene.right));
  add_original(rows, name + "/1-thread-to-original");
  compare(rows, name + "/1-thread-grey", "cv::StereoBM unfiltered", one, rounds, with_block,
          with(*grey, scene.left_grey, scene.right_grey));
  const auto avx2 = avx2_matcher(3, parameters);
  compare(rows, name + "/1-thread-avx2", "cv::StereoBM unfiltered, on grey",
          std::string("one thread, ") + avx2->target(), rounds, with_block, with(*avx2, scene.left, scene.right));
  compare(rows, name + "/1-thread-to-sgbm", "cv::StereoSGBM 3-way", one, rounds, with_global,
          with(*colour, scene.left, scene.right));
  compare(rows, name + "/quality", "cv::StereoSGBM 3-way", one, rounds, with_global,
          with(*quality, scene.left, scene.right));
  compare(rows, name + "/quality-to-padded", "cv::StereoSGBM 3-way, padded on the left: every column", one, rounds,
          with_padded_global, with(*quality, scene.left, scene.right));
  for (const auto& [method, full, p] :
       {std::tuple("default", colour.get(), &parameters), std::tuple("quality", quality.get(), &quality_parameters)}) {
    stereo::HalfMatcher half(kWidth, kHeight, 3, *p);
    const std::string levels = name + "/" + method + "-level-";
    compare(rows, levels + "half", "the same at level full", one, rounds, with(*full, scene.left, scene.right),
            with(half, scene.left, scene.right));
    half.limit_search(kDisparities / 2);
    compare(rows, levels + "half_range", "the same at level full", one, rounds, with(*full, scene.left, scene.right),
            with(half, scene.left, scene.right));
  }
  const TwoCores cores;
  stereo::BandMatcher bands(kWidth, kHeight, 3, parameters, 2);
  compare(rows, name + "/2-bands", "the same on one thread", "two threads on " + cores.text() + ", " + colour->target(),
          rounds, with(*colour, scene.left, scene.right), with(bands, scene.left, scene.right));
  return rows;
}

}  // namespace takt::bench
