// SPDX-License-Identifier: Apache-2.0
#include "nodes/stereo/rectify.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/quaternion.hpp>
#include <stdexcept>
#include <string>

#include "nodes/stereo/opencv_calibration.hpp"

namespace takt::stereo {
namespace {

/// Sources of the pixels of one rectified image, as OpenCV computes them.
std::vector<RemapSource> sources(const cv::Mat& matrix, const cv::Mat& distortion, const cv::Mat& rotation,
                                 const cv::Mat& projection, cv::Size size) {
  cv::Mat x, y;
  cv::initUndistortRectifyMap(matrix, distortion, rotation, projection, size, CV_32F, x, y);
  std::vector<RemapSource> out(static_cast<size_t>(size.area()));
  size_t i = 0;
  for (int row = 0; row < size.height; ++row)
    for (int column = 0; column < size.width; ++column, ++i) {
      const double sx = x.at<float>(row, column), sy = y.at<float>(row, column);
      // !(>= 0) also catches what is not a number.
      if (!(sx >= 0) || !(sy >= 0) || !(sx <= size.width - 1) || !(sy <= size.height - 1)) continue;
      const int fx = static_cast<int>(std::lround(sx * 128)), fy = static_cast<int>(std::lround(sy * 128));
      const int x0 = std::min(fx >> 7, size.width - 2), y0 = std::min(fy >> 7, size.height - 2);
      out[i] = {static_cast<int16_t>(x0), static_cast<int16_t>(y0), static_cast<uint8_t>(fx - 128 * x0),
                static_cast<uint8_t>(fy - 128 * y0)};
    }
  return out;
}

}  // namespace

RectificationTables rectification_tables(const StereoCalibration& c) {
  check_calibration(c);
  const cv::Mat k1 = opencv_matrix(c.left_matrix, 3), k2 = opencv_matrix(c.right_matrix, 3),
                d1 = opencv_distortion(c.left_distortion, c.left_more),
                d2 = opencv_distortion(c.right_distortion, c.right_more);
  const cv::Size size(c.width, c.height);
  cv::Mat r1, r2, p1, p2, q;
  cv::stereoRectify(k1, d1, k2, d2, size, opencv_matrix(c.rotation, 3), opencv_matrix(c.translation_m, 3), r1, r2, p1,
                    p2, q, cv::CALIB_ZERO_DISPARITY, 0);
  const double focal = p1.at<double>(0, 0), baseline = -p2.at<double>(0, 3) / focal;
  if (!(focal > 0) || !(baseline > 0) || p2.at<double>(1, 3) != 0)
    throw std::invalid_argument(
        "stereo calibration: translation_m is " + std::to_string(c.translation_m[0]) + ", " +
        std::to_string(c.translation_m[1]) + ", " + std::to_string(c.translation_m[2]) +
        "; the right camera must stand to the right of the left one (x < 0); are they swapped?");
  RectificationTables tables;
  tables.camera = {focal, p1.at<double>(0, 2), p1.at<double>(1, 2), baseline};
  const auto turn = cv::Quatd::createFromRotMat(r1.t());
  tables.rectified_in_raw = {0, 0, 0, turn.w, turn.x, turn.y, turn.z};
  tables.left = sources(k1, d1, r1, p1, size);
  tables.right = sources(k2, d2, r2, p2, size);
  return tables;
}

RectificationTables undistortion_table(const StereoCalibration& c) {
  check_calibration(c);
  const auto& m = c.left_matrix;
  const double focal = (m[0] + m[4]) / 2;
  const std::array<double, 9> ideal{focal, 0, m[2], 0, focal, m[5], 0, 0, 1};
  RectificationTables tables;
  tables.camera = {focal, m[2], m[5], std::hypot(c.translation_m[0], c.translation_m[1], c.translation_m[2])};
  tables.left = sources(opencv_matrix(m, 3), opencv_distortion(c.left_distortion, c.left_more),
                        cv::Mat::eye(3, 3, CV_64F), opencv_matrix(ideal, 3), {c.width, c.height});
  return tables;
}

Rectifier::Rectifier(const StereoCalibration& c, BayerPattern pattern)
    : width_(c.width), height_(c.height), pattern_(pattern) {
  const RectificationTables tables = rectification_tables(c);
  camera_ = tables.camera;
  rectified_in_raw_ = tables.rectified_in_raw;
  left_ = Remap(width_, height_, tables.left);
  right_ = Remap(width_, height_, tables.right);
  window_.resize(std::max(left_.window_bytes(), right_.window_bytes()));
}

bool Rectifier::rectify(ImageView<const uint8_t> left, ImageView<const uint8_t> right, ImageView<uint8_t> left_out,
                        ImageView<uint8_t> right_out) {
  const auto fits = [&](const auto& v, int channels) {
    return v.data != nullptr && v.width == width_ && v.height == height_ && v.channels == channels;
  };
  const int in = pattern_ == BayerPattern::none && left.channels == 3 ? 3 : 1;
  const int out = pattern_ == BayerPattern::none ? in : 3;
  if (!fits(left, in) || !fits(right, in) || !fits(left_out, out) || !fits(right_out, out)) return false;
  if (window_.empty()) {
    const auto bytes = static_cast<size_t>(width_) * static_cast<size_t>(in);
    for (int y = 0; y < height_; ++y) {
      std::memcpy(left_out.row(y), left.row(y), bytes);
      std::memcpy(right_out.row(y), right.row(y), bytes);
    }
    return true;
  }
  left_.run(left, pattern_, window_, left_out);
  right_.run(right, pattern_, window_, right_out);
  return true;
}

}  // namespace takt::stereo
