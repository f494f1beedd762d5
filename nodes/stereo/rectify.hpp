// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "nodes/stereo/debayer.hpp"
#include "nodes/stereo/remap.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/image_view.hpp"

namespace takt::stereo {

/// Calibration of a raw stereo pair. Matrices are row-major.
struct StereoCalibration {
  int width = 0, height = 0;                                    ///< px, of the raw and of the rectified images
  std::array<double, 9> left_matrix{}, right_matrix{};          ///< fu 0 cu / 0 fv cv / 0 0 1, px
  std::array<double, 5> left_distortion{}, right_distortion{};  ///< k1 k2 p1 p2 k3
  std::array<double, 9> left_more{}, right_more{};              ///< k4 k5 k6 s1 s2 s3 s4 tx ty of OpenCV
  std::array<double, 9> rotation{1, 0, 0, 0, 1, 0, 0, 0, 1};    ///< p_right = rotation p_left + translation
  std::array<double, 3> translation_m{};                        ///< right camera beside the left: x about -baseline
};

/// Throws std::invalid_argument for values that are not finite, sizes outside 16..8192, focal lengths that are not
/// positive, a rotation that is none, and values that cannot be meant: a baseline outside 1 mm to 10 m, a principal
/// point outside the image.
void check_calibration(const StereoCalibration& calibration);

/// Model of the rectified images, and where each of their pixels comes from (width x height, row by row).
struct RectificationTables {
  CameraModel camera;
  Transform rectified_in_raw;  ///< the left camera turned about its optical centre
  std::vector<RemapSource> left, right;
};

/// The tables that bring epipolar lines onto rows (thesis Sec. 3.5.2). Throws as check_calibration(), and for cameras
/// that do not stand left and right of each other.
RectificationTables rectification_tables(const StereoCalibration& calibration);

/// The table that undistorts the left image alone (`right` is empty): the camera keeps its direction and its matrix, as
/// far as that has one focal length. Throws as rectification_tables().
RectificationTables undistortion_table(const StereoCalibration& calibration);

/// Undistorts and rectifies pairs so that epipolar lines are rows of equal number. Memory is taken by the constructor;
/// one thread at a time.
class Rectifier {
 public:
  /// For raw pairs; with a pattern they are mosaics of one channel and become BGR. Throws as rectification_tables().
  explicit Rectifier(const StereoCalibration& calibration, BayerPattern pattern = BayerPattern::none);
  /// For pairs that are rectified already: rectify() copies.
  Rectifier(int width, int height, const CameraModel& camera) : width_(width), height_(height), camera_(camera) {}

  /// Model of the rectified images.
  const CameraModel& camera() const { return camera_; }
  /// The frame of the rectified left camera in that of the raw one: a turn about the optical centre.
  const Transform& rectified_in_raw() const { return rectified_in_raw_; }
  int width() const { return width_; }
  int height() const { return height_; }

  /// Bilinear, 1/128 px, of the debayered images if there is a pattern; pixels that see nothing become 0. All views
  /// have the calibrated size and 1 or 3 channels alike, with a pattern 1 in and 3 out; in and out do not overlap.
  /// Returns false, and writes nothing, if they do not fit.
  [[nodiscard]] bool rectify(ImageView<const uint8_t> left, ImageView<const uint8_t> right, ImageView<uint8_t> left_out,
                             ImageView<uint8_t> right_out);

 private:
  int width_ = 0, height_ = 0;
  CameraModel camera_;
  Transform rectified_in_raw_;
  BayerPattern pattern_ = BayerPattern::none;
  Remap left_, right_;
  std::vector<int8_t> window_;  ///< of both, one after the other; empty: pass through
};

}  // namespace takt::stereo
