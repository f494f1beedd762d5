// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "nodes/stereo/remap_kernel.hpp"
#include "rt/msg/messages.hpp"

namespace takt::stereo {

/// Calibration of a raw stereo pair. Matrices are row-major.
struct StereoCalibration {
  int width = 0, height = 0;                                    ///< px, of the raw and of the rectified images
  std::array<double, 9> left_matrix{}, right_matrix{};          ///< fu 0 cu / 0 fv cv / 0 0 1, px
  std::array<double, 5> left_distortion{}, right_distortion{};  ///< k1 k2 p1 p2 k3
  std::array<double, 9> rotation{1, 0, 0, 0, 1, 0, 0, 0, 1};    ///< p_right = rotation p_left + translation
  std::array<double, 3> translation_m{};                        ///< right camera beside the left: x about -baseline
};

/// Reads a calibration in OpenCV's YAML or XML form: M1, D1, M2, D2 (as written by its stereo calibration), R, T
/// (metres) and image_size [width, height]. Throws std::invalid_argument naming file, key and value.
StereoCalibration read_calibration(const std::filesystem::path& file);

/// Undistorts and rectifies a pair so that epipolar lines are rows of equal number (thesis Sec. 3.5.2).
class Rectifier {
 public:
  /// Builds the remap tables. Throws std::invalid_argument for values that are not finite, sizes outside 16..8192,
  /// focal lengths that are not positive, a rotation that is none, or cameras that do not stand left and right of each
  /// other.
  explicit Rectifier(const StereoCalibration& calibration);
  /// For pairs that are rectified already: rectify() copies.
  Rectifier(int width, int height, const CameraModel& camera) : width_(width), height_(height), camera_(camera) {}

  /// Model of the rectified images.
  const CameraModel& camera() const { return camera_; }
  int width() const { return width_; }
  int height() const { return height_; }

  /// Bilinear, 1/128 px; pixels that see nothing become 0. All views have the calibrated size and 1 or 3 channels
  /// alike; in and out do not overlap. Returns false, and writes nothing, if they do not fit.
  [[nodiscard]] bool rectify(ImageView<const uint8_t> left, ImageView<const uint8_t> right, ImageView<uint8_t> left_out,
                             ImageView<uint8_t> right_out) const;

 private:
  void build(const StereoCalibration& calibration);
  void remap(const std::vector<RemapSource>& map, ImageView<const uint8_t> in, ImageView<uint8_t> out) const;

  int width_ = 0, height_ = 0;
  CameraModel camera_;
  RemapRow remap_row_ = remap_row();
  std::vector<RemapSource> left_, right_;  ///< empty: pass through
};

}  // namespace takt::stereo
