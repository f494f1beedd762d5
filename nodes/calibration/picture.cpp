// SPDX-License-Identifier: Apache-2.0
#include "nodes/calibration/picture.hpp"

#include <opencv2/imgproc.hpp>

namespace takt::calibration {
namespace {

constexpr int kLines = 16, kGap = 8;
const cv::Scalar kGreen(80, 220, 80), kRed(60, 60, 235), kYellow(60, 220, 250), kBack(40, 40, 40), kPale(90, 90, 90);

void draw_dots(cv::Mat& onto, const std::vector<cv::Point2f>& points, const cv::Scalar& colour) {
  for (const cv::Point2f& p : points) cv::circle(onto, p, 2, colour, cv::FILLED, cv::LINE_AA);
}

void draw_coverage(cv::Mat onto, std::span<const View> views, const CalibrationResult& result,
                   std::vector<cv::Point2f> View::*corners) {
  cv::rectangle(onto, {0, 0, onto.cols, onto.rows}, kPale);
  for (const RejectedView& rejected : result.rejected) draw_dots(onto, views[rejected.view].*corners, kRed);
  for (const size_t used : result.used) draw_dots(onto, views[used].*corners, kGreen);
}

}  // namespace

cv::Mat draw_calibration(const RectifiedPair& pair, std::span<const View> views, const CalibrationResult& result) {
  const int width = pair.images.left.cols, height = pair.images.left.rows;
  cv::Mat picture(2 * height + kGap, 2 * width + kGap, CV_8UC3, kBack);
  const cv::Rect left(0, 0, width, height), right(width + kGap, 0, width, height);
  const cv::Point down(0, height + kGap);
  cv::cvtColor(pair.images.left, picture(left), cv::COLOR_GRAY2BGR);
  cv::cvtColor(pair.images.right, picture(right), cv::COLOR_GRAY2BGR);
  for (int line = 1; line < kLines; ++line) {
    const int y = line * height / kLines;
    cv::line(picture, {0, y}, {picture.cols - 1, y}, kYellow);
  }
  cv::Mat left_image = picture(left), right_image = picture(right);
  draw_dots(left_image, pair.left, kGreen);
  draw_dots(right_image, pair.right, kGreen);
  draw_coverage(picture(left + down), views, result, &View::left);
  draw_coverage(picture(right + down), views, result, &View::right);
  return picture;
}

}  // namespace takt::calibration
