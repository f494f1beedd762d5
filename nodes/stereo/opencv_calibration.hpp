// SPDX-License-Identifier: Apache-2.0
// Parts of a calibration as OpenCV takes and writes them.
#pragma once
#include <algorithm>
#include <array>
#include <cstring>
#include <opencv2/core/mat.hpp>
#include <span>
#include <vector>

namespace takt::stereo {

inline cv::Mat opencv_matrix(std::span<const double> values, int rows) {
  cv::Mat m(rows, static_cast<int>(values.size()) / rows, CV_64F);
  std::memcpy(m.data, values.data(), values.size_bytes());
  return m;
}

/// Five coefficients, or all 14.
inline cv::Mat opencv_distortion(const std::array<double, 5>& first, const std::array<double, 9>& more) {
  std::vector<double> all(first.begin(), first.end());
  if (std::any_of(more.begin(), more.end(), [](double value) { return value != 0; }))
    all.insert(all.end(), more.begin(), more.end());
  return opencv_matrix(all, 1);
}

}  // namespace takt::stereo
