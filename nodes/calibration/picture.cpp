// SPDX-License-Identifier: Apache-2.0
#include "nodes/calibration/picture.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "nodes/laser_fusion/fusion.hpp"
#include "nodes/picture/clouds.hpp"
#include "rt/msg/point.hpp"

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

constexpr size_t kPointsOfSweep = 30'000;
constexpr laser_fusion::FusionParameters kApart{.sigma_m = 0.01, .confidence_min = 1e-4};

size_t stride_of(const LaserSweep& sweep) { return stride(sweep.returns.size(), kPointsOfSweep); }

/// All sweeps, each with its mount.
cloud::Cloud laid_out(const LaserRecording& recording, const std::vector<Rigid>& mounts) {
  constexpr Colour kFirst{220, 220, 220}, kOthers{0, 140, 255}, kObject{80, 220, 80};
  cloud::Cloud cloud;
  for (size_t s = 0; s < mounts.size(); ++s) {
    const LaserSweep& sweep = recording.sweeps[s];
    const std::vector<Point> points = in_room(sweep, mounts[s], stride_of(sweep));
    for (size_t i = 0; i < points.size(); ++i) {
      cloud.points.push_back(points[i]);
      cloud.colours.push_back(sweep.returns[i * stride_of(sweep)].on_object ? kObject : s == 0 ? kFirst : kOthers);
    }
  }
  return cloud;
}

/// All sweeps but the first, coloured by their distances from it.
cloud::Cloud residuals(const LaserRecording& recording, const std::vector<Rigid>& mounts) {
  const std::vector<Point> room = in_room(recording.sweeps.front(), mounts.front());
  const std::vector<Colour> colours(room.size());
  laser_fusion::NearestTable table(room.size());
  table.build(room, laser_fusion::farthest_match_m(kApart), 1);
  cloud::Cloud cloud;
  for (size_t s = 1; s < mounts.size(); ++s)
    laser_fusion::fuse(in_room(recording.sweeps[s], mounts[s], stride_of(recording.sweeps[s])), table, colours, {},
                       kApart, [&](const Point& point, const Colour&, double confidence) {
                         cloud.points.push_back(point);
                         cloud.colours.push_back(laser_fusion::confidence_colour(confidence));
                       });
  return cloud;
}

}  // namespace

cv::Mat draw_calibration(const LaserRecording& recording, std::span<const CalibratedScanner> scanners) {
  std::vector<Rigid> known, found;
  for (const LaserSweep& sweep : recording.sweeps) known.push_back(laser_fusion::to_rigid(sweep.mount));
  for (const CalibratedScanner& scanner : scanners) found.push_back(laser_fusion::to_rigid(scanner.mount));
  const cloud::Cloud after = laid_out(recording, found), before = laid_out(recording, known),
                     apart = residuals(recording, found);
  const cloud::CloudView views[] = {before.view(), after.view(), apart.view()};
  return picture::draw_clouds(views);
}

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
