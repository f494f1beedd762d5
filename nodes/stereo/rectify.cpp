// SPDX-License-Identifier: Apache-2.0
#include "nodes/stereo/rectify.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/quaternion.hpp>
#include <span>
#include <stdexcept>
#include <string>

#include "rt/file/output_file.hpp"

namespace takt::stereo {
namespace {

[[noreturn]] void refuse(const std::string& what) { throw std::invalid_argument("stereo calibration: " + what); }

void check_finite(const char* name, std::span<const double> values) {
  for (size_t i = 0; i < values.size(); ++i)
    if (!std::isfinite(values[i]))
      refuse(std::string(name) + "[" + std::to_string(i) + "] is " + std::to_string(values[i]) +
             ", must be finite; calibrate again");
}

void check(const StereoCalibration& c) {
  if (c.width < 16 || c.width > 8192 || c.height < 16 || c.height > 8192)
    refuse("image size is " + std::to_string(c.width) + " x " + std::to_string(c.height) +
           ", each must lie in 16..8192");
  check_finite("left_matrix", c.left_matrix);
  check_finite("right_matrix", c.right_matrix);
  check_finite("left_distortion", c.left_distortion);
  check_finite("right_distortion", c.right_distortion);
  check_finite("rotation", c.rotation);
  check_finite("translation_m", c.translation_m);
  for (const auto* m : {&c.left_matrix, &c.right_matrix})
    if (!((*m)[0] > 0) || !((*m)[4] > 0))
      refuse("focal lengths are " + std::to_string((*m)[0]) + " and " + std::to_string((*m)[4]) +
             " px, must be positive");
  for (size_t i = 0; i < 3; ++i)
    for (size_t j = i; j < 3; ++j) {
      double dot = 0;
      for (size_t k = 0; k < 3; ++k) dot += c.rotation[3 * i + k] * c.rotation[3 * j + k];
      if (std::abs(dot - (i == j ? 1 : 0)) > 1e-3)
        refuse("rotation is not orthonormal: rows " + std::to_string(i) + " and " + std::to_string(j) +
               " have the product " + std::to_string(dot));
    }
}

cv::Mat matrix(std::span<const double> values, int rows) {
  cv::Mat m(rows, static_cast<int>(values.size()) / rows, CV_64F);
  std::memcpy(m.data, values.data(), values.size_bytes());
  return m;
}

template <size_t kCount>
void read(const cv::FileStorage& file, const std::string& path, const char* key, std::array<double, kCount>& out) {
  const cv::FileNode node = file[key];
  if (node.empty()) refuse(path + ": key " + key + " is missing; M1, D1, M2, D2, R, T and image_size are needed");
  cv::Mat m;
  node >> m;
  if (m.total() != kCount)
    refuse(path + ": key " + key + " has " + std::to_string(m.total()) + " numbers, must have " +
           std::to_string(kCount));
  m.convertTo(m, CV_64F);
  std::memcpy(out.data(), m.data, sizeof out);
}

void read_cameras(const cv::FileStorage& file, const std::string& path, StereoCalibration& c) {
  read(file, path, "M1", c.left_matrix);
  read(file, path, "D1", c.left_distortion);
  read(file, path, "M2", c.right_matrix);
  read(file, path, "D2", c.right_distortion);
}

template <class Keys>
StereoCalibration read_file(const std::filesystem::path& path, const Keys& read_keys) {
  StereoCalibration c;
  if (!std::filesystem::exists(path)) refuse(path.string() + ": no such file; check parameter `calibration`");
  try {
    const cv::FileStorage file(path.string(), cv::FileStorage::READ);
    if (!file.isOpened()) refuse(path.string() + ": cannot be read as OpenCV YAML or XML");
    read_keys(file, c);
  } catch (const cv::Exception& e) {
    refuse(path.string() + ": " + e.err);
  }
  return c;
}

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

StereoCalibration read_calibration(const std::filesystem::path& path) {
  return read_file(path, [&](const cv::FileStorage& file, StereoCalibration& c) {
    read_cameras(file, path.string(), c);
    read(file, path.string(), "R", c.rotation);
    read(file, path.string(), "T", c.translation_m);
    std::vector<int> size;
    file["image_size"] >> size;
    if (size.size() != 2) refuse(path.string() + ": key image_size must be [width, height]");
    c.width = size[0];
    c.height = size[1];
  });
}

StereoCalibration read_intrinsics(const std::filesystem::path& path) {
  return read_file(path,
                   [&](const cv::FileStorage& file, StereoCalibration& c) { read_cameras(file, path.string(), c); });
}

void write_calibration(const std::filesystem::path& path, const StereoCalibration& c, const std::string& comment) {
  const std::string extension = path.extension().string();
  if (extension != ".yaml" && extension != ".yml" && extension != ".xml")
    refuse(path.string() + ": must end in .yaml, .yml or .xml");
  try {
    cv::FileStorage file(path.string(), cv::FileStorage::WRITE | cv::FileStorage::MEMORY);  // its format by the name
    file.writeComment(comment);
    file << "image_size" << std::vector<int>{c.width, c.height};
    file << "M1" << matrix(c.left_matrix, 3) << "D1" << matrix(c.left_distortion, 1);
    file << "M2" << matrix(c.right_matrix, 3) << "D2" << matrix(c.right_distortion, 1);
    file << "R" << matrix(c.rotation, 3) << "T" << matrix(c.translation_m, 3);
    require_written(write_file(path, file.releaseAndGetString()));
  } catch (const cv::Exception& e) {
    refuse(path.string() + ": " + e.err);
  }
}

RectificationTables rectification_tables(const StereoCalibration& c) {
  check(c);
  const cv::Mat k1 = matrix(c.left_matrix, 3), k2 = matrix(c.right_matrix, 3), d1 = matrix(c.left_distortion, 1),
                d2 = matrix(c.right_distortion, 1);
  const cv::Size size(c.width, c.height);
  cv::Mat r1, r2, p1, p2, q;
  cv::stereoRectify(k1, d1, k2, d2, size, matrix(c.rotation, 3), matrix(c.translation_m, 3), r1, r2, p1, p2, q,
                    cv::CALIB_ZERO_DISPARITY, 0);
  const double focal = p1.at<double>(0, 0), baseline = -p2.at<double>(0, 3) / focal;
  if (!(focal > 0) || !(baseline > 0) || p2.at<double>(1, 3) != 0)
    refuse("translation_m is " + std::to_string(c.translation_m[0]) + ", " + std::to_string(c.translation_m[1]) + ", " +
           std::to_string(c.translation_m[2]) +
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
  check(c);
  const auto& m = c.left_matrix;
  const double focal = (m[0] + m[4]) / 2;
  const std::array<double, 9> ideal{focal, 0, m[2], 0, focal, m[5], 0, 0, 1};
  RectificationTables tables;
  tables.camera = {focal, m[2], m[5], std::hypot(c.translation_m[0], c.translation_m[1], c.translation_m[2])};
  tables.left = sources(matrix(m, 3), matrix(c.left_distortion, 1), cv::Mat::eye(3, 3, CV_64F), matrix(ideal, 3),
                        {c.width, c.height});
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
