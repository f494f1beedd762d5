// SPDX-License-Identifier: Apache-2.0
#include "nodes/picture/curves.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "nodes/picture/image_file.hpp"

namespace takt::picture {
namespace {

const cv::Scalar kCurve(255, 140, 60), kText(40, 40, 40), kGrid(220, 220, 220);

void label(cv::Mat& image, const std::string& text, cv::Point at) {
  cv::putText(image, text, at, cv::FONT_HERSHEY_SIMPLEX, 0.42, kText, 1, cv::LINE_AA);
}

}  // namespace

void write_curves(const std::string& file, const std::string& parameter, const std::vector<double>& values,
                  const std::vector<Curve>& curves) {
  constexpr int kLeft = 90, kTop = 30, kPanel = 150, kGap = 34, kStep = 84;
  const int count = static_cast<int>(values.size()), width = kLeft + kStep * count;
  const int height = kTop + static_cast<int>(curves.size()) * (kPanel + kGap) + 20;
  cv::Mat image(height, width, CV_8UC3, cv::Scalar::all(255));
  int top = kTop;
  for (const Curve& curve : curves) {
    const double range = std::max(1e-9, *std::max_element(curve.values.begin(), curve.values.end()) - curve.foot);
    const auto at = [&](int i) {
      const double share = (curve.values[static_cast<size_t>(i)] - curve.foot) / range;
      return cv::Point(kLeft + kStep * i, top + kPanel - static_cast<int>(share * (kPanel - 20)));
    };
    label(image, curve.label, {kLeft, top - 8});
    cv::line(image, {kLeft, top + kPanel}, {width - 20, top + kPanel}, kGrid);
    for (int i = 0; i < count; ++i) {
      if (i > 0) cv::line(image, at(i - 1), at(i), kCurve, 2, cv::LINE_AA);
      cv::circle(image, at(i), 3, kCurve, cv::FILLED, cv::LINE_AA);
      label(image, fmt::format("{:.4g}", curve.values[static_cast<size_t>(i)]), at(i) + cv::Point(4, -6));
    }
    top += kPanel + kGap;
  }
  for (int i = 0; i < count; ++i)
    label(image, fmt::format("{:g}", values[static_cast<size_t>(i)]), {kLeft + kStep * i - 6, height - 18});
  label(image, parameter, {4, height - 18});
  require_written(write_image(file, image));
}

}  // namespace takt::picture
