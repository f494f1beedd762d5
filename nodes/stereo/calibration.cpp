// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <span>
#include <stdexcept>
#include <string>

#include "nodes/stereo/rectify.hpp"

namespace takt::stereo {
namespace {

[[noreturn]] void refuse(const std::string& what) { throw std::invalid_argument("stereo calibration: " + what); }

void check_finite(const char* name, std::span<const double> values) {
  for (size_t i = 0; i < values.size(); ++i)
    if (!std::isfinite(values[i]))
      refuse(std::string(name) + "[" + std::to_string(i) + "] is " + std::to_string(values[i]) +
             ", must be finite; calibrate again");
}

/// Values that cannot be meant: metres and millimetres, or columns, were taken for each other.
void doubt(const StereoCalibration& c) {
  constexpr double kShortest_m = 1e-3, kLongest_m = 10;
  const double baseline = std::hypot(c.translation_m[0], c.translation_m[1], c.translation_m[2]);
  if (baseline > kLongest_m || (baseline > 0 && baseline < kShortest_m))
    refuse("translation_m is a baseline of " + std::to_string(baseline) +
           " m, which cannot be meant (1 mm to 10 m); it counts in metres: 120 mm is 0.12");
  for (const auto* m : {&c.left_matrix, &c.right_matrix})
    if ((*m)[2] < 0 || (*m)[2] > c.width || (*m)[5] < 0 || (*m)[5] > c.height || (*m)[0] > 100.0 * c.width)
      refuse("a camera with focal length " + std::to_string((*m)[0]) + " px and principal point " +
             std::to_string((*m)[2]) + ", " + std::to_string((*m)[5]) + " px cannot be meant for images of " +
             std::to_string(c.width) + " x " + std::to_string(c.height) + "; was it calibrated at another resolution?");
}

}  // namespace

void check_calibration(const StereoCalibration& c) {
  if (c.width < 16 || c.width > 8192 || c.height < 16 || c.height > 8192)
    refuse("image size is " + std::to_string(c.width) + " x " + std::to_string(c.height) +
           ", each must lie in 16..8192");
  check_finite("left_matrix", c.left_matrix);
  check_finite("right_matrix", c.right_matrix);
  check_finite("left_distortion", c.left_distortion);
  check_finite("right_distortion", c.right_distortion);
  check_finite("left_more", c.left_more);
  check_finite("right_more", c.right_more);
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
  doubt(c);
}

}  // namespace takt::stereo
