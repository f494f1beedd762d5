// SPDX-License-Identifier: Apache-2.0
// Debayering and rectification of a 640x480 pair on one thread, against OpenCV's debayering and its resampling through
// fixed-point maps; and the watch over the rows of what comes out. CPU time of both images.
#include "nodes/stereo/rectify.hpp"

#include <cstdio>
#include <functional>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "bench/interleaved.hpp"
#include "bench/suite.hpp"
#include "nodes/stereo/rectification_monitor.hpp"
#include "rt/time/clock.hpp"

namespace takt::bench {

std::vector<Row> run_rectify(const Options& options);

namespace {

constexpr int kWidth = 640, kHeight = 480, kDisparities = 150;
constexpr int kRepeats = 5;  // in one sample

/// A 66 degree lens with barrel distortion, the right camera a quarter of a degree out of true.
stereo::StereoCalibration calibration() {
  stereo::StereoCalibration c;
  c.width = kWidth;
  c.height = kHeight;
  c.left_matrix = {493, 0, 322, 0, 493, 238, 0, 0, 1};
  c.right_matrix = {495, 0, 317, 0, 495, 243, 0, 0, 1};
  c.left_distortion = {-0.12, 0.02, 0.0004, -0.0003, 0};
  c.right_distortion = {-0.11, 0.02, -0.0002, 0.0005, 0};
  cv::Matx33d rotation;
  cv::Rodrigues(cv::Vec3d(0.0035, -0.005, 0.0026), rotation);
  std::copy_n(rotation.val, 9, c.rotation.begin());
  c.translation_m = {-0.24, 0.001, 0.002};
  return c;
}

/// The same calibration as OpenCV's maps.
struct Maps {
  cv::Mat position[2], fraction[2];
  explicit Maps(const stereo::StereoCalibration& c) {
    const auto matrix = [](const auto& v, int rows) {
      return cv::Mat(std::vector<double>(v.begin(), v.end()), true).reshape(1, rows);
    };
    const cv::Mat k[2] = {matrix(c.left_matrix, 3), matrix(c.right_matrix, 3)};
    const cv::Mat d[2] = {matrix(c.left_distortion, 1), matrix(c.right_distortion, 1)};
    cv::Mat r[2], p[2], q;
    const cv::Size size(kWidth, kHeight);
    cv::stereoRectify(k[0], d[0], k[1], d[1], size, matrix(c.rotation, 3), matrix(c.translation_m, 3), r[0], r[1], p[0],
                      p[1], q, cv::CALIB_ZERO_DISPARITY, 0);
    for (int i = 0; i < 2; ++i)
      cv::initUndistortRectifyMap(k[i], d[i], r[i], p[i], size, CV_16SC2, position[i], fraction[i]);
  }
  void remap(const cv::Mat* in, cv::Mat* out) const {
    for (int i = 0; i < 2; ++i) cv::remap(in[i], out[i], position[i], fraction[i], cv::INTER_LINEAR);
  }
};

/// Left and right, of one kind.
struct Images {
  cv::Mat image[2];
  explicit Images(int channels) {
    for (cv::Mat& m : image) m.create(kHeight, kWidth, CV_8UC(channels));
  }
  ImageView<uint8_t> view(int i) const { return {image[i].data, kWidth, kHeight, image[i].channels()}; }
};

/// Smoothed noise, the right image shifted by 20 px.
Images texture(int channels) {
  Images out(channels);
  cv::theRNG().state = 1;
  cv::randu(out.image[0], 0, 256);
  cv::GaussianBlur(out.image[0], out.image[0], {0, 0}, 1.5);
  cv::normalize(out.image[0], out.image[0], 0, 255, cv::NORM_MINMAX);
  cv::warpAffine(out.image[0], out.image[1], cv::Matx23d(1, 0, -20, 0, 1, 0), {kWidth, kHeight});
  return out;
}

using Work = std::function<void()>;

double milliseconds(const Work& work) {
  const int64_t begin = thread_cpu_ns();
  for (int i = 0; i < kRepeats; ++i) work();
  return static_cast<double>(thread_cpu_ns() - begin) * 1e-6 / kRepeats;
}

Row row(const std::string& what) {
  std::fprintf(stderr, "rectify: %s\n", what.c_str());
  return {"rectify/" + what + "/640x480", "ms", 0, {}, {}, {}, {}, "one thread, CPU time"};
}

void against(std::vector<Row>& rows, const std::string& what, const std::string& reference, int rounds,
             const Work& theirs, const Work& ours) {
  Row out = row(what);
  theirs();
  ours();
  const Compared compared = compare(
      static_cast<size_t>(rounds), [&] { return milliseconds(theirs); }, [&] { return milliseconds(ours); });
  out.samples = compared.changed;
  add_pair(rows, std::move(out), reference, compared.pairs);
}

void rectify(stereo::Rectifier& rectifier, const Images& in, const Images& out) {
  if (!rectifier.rectify(in.view(0), in.view(1), out.view(0), out.view(1)))
    throw CannotRun("the rectifier refused its input");
}

/// The right image moved down by so many rows: beyond its reach every place is looked for far and wide.
Row row_check(const std::string& what, int down, int rounds) {
  const Images pair = texture(3);
  cv::warpAffine(pair.image[1].clone(), pair.image[1], cv::Matx23d(1, 0, 0, 0, 1, down), {kWidth, kHeight});
  const std::vector<int16_t> disparity(size_t{kWidth} * kHeight, int16_t{20});
  stereo::RectificationMonitor monitor(kWidth, kHeight, kDisparities);
  Row out = row(what);
  for (int i = 0; i < rounds; ++i)
    out.samples.add(milliseconds([&] {
      monitor.observe(pair.view(0), pair.view(1), {disparity.data(), kWidth, kHeight});
      monitor.row_error_px();
    }));
  out.value = *out.samples.quantile(0.5);
  return out;
}

}  // namespace

std::vector<Row> run_rectify(const Options& options) {
  cv::setNumThreads(1);
  const int rounds = options.rounds_or(40);
  const stereo::StereoCalibration cameras = calibration();
  const Maps maps(cameras);
  std::vector<Row> rows;
  {
    stereo::Rectifier rectifier(cameras, stereo::BayerPattern::rggb);
    const Images in = texture(1), out(3);
    Images colour(3), theirs(3);
    against(
        rows, "debayer_bgr", "cv::cvtColor and cv::remap", rounds,
        [&] {
          for (int i = 0; i < 2; ++i) cv::cvtColor(in.image[i], colour.image[i], cv::COLOR_BayerBG2BGR);
          maps.remap(colour.image, theirs.image);
        },
        [&] { rectify(rectifier, in, out); });
  }
  for (const int channels : {3, 1}) {
    stereo::Rectifier rectifier(cameras);
    const Images in = texture(channels), out(channels);
    Images theirs(channels);
    against(
        rows, channels == 3 ? "bgr" : "grey", "cv::remap", rounds, [&] { maps.remap(in.image, theirs.image); },
        [&] { rectify(rectifier, in, out); });
  }
  rows.push_back(row_check("row_check_bgr", 0, rounds));
  rows.push_back(row_check("row_check_far_bgr", 8, rounds));
  return rows;
}

}  // namespace takt::bench
