// SPDX-License-Identifier: Apache-2.0
#include "graph/evaluate/ego_motion_picture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "nodes/picture/image_file.hpp"
#include "rt/msg/geometry.hpp"

namespace takt::command {
namespace {

using namespace ego_motion;

const cv::Scalar kBlue(255, 140, 60), kGreen(60, 220, 60), kRed(60, 60, 255);

void write(const std::string& file, const cv::Mat& image) { require_written(picture::write_image(file, image)); }

}  // namespace

void write_flow_picture(const std::string& file, const Drive& drive, const Parameters& parameters) {
  EgoMotion ego;
  const cv::Size size = drive.frames.front().left.size();
  ego.configure(size.width, size.height, parameters);
  const size_t middle = drive.frames.size() / 2;
  Result result;
  for (size_t i = 0; i <= middle; ++i) result = ego.step(frame_of(drive, i));
  cv::Mat image;
  cv::cvtColor(drive.frames[middle].left, image, cv::COLOR_GRAY2BGR);
  for (const TrackedCorner& c : ego.corners()) cv::circle(image, {c.corner.x, c.corner.y}, 1, kBlue, cv::FILLED);
  const auto draw = [&](double x, double y, double dx, double dy, const cv::Scalar& colour) {
    cv::line(image, cv::Point2d(x, y), cv::Point2d(x + dx, y + dy), colour, 1, cv::LINE_AA);
  };
  // Red first: what agrees is drawn over it, what a filter took out stays.
  for (const Flow& f : ego.flows()) draw(f.x, f.y, f.dx, f.dy, kRed);
  const CameraModel& camera = drive.camera;
  const Rigid T = from_transform(result.camera_in_previous.transform).inverse();
  for (const Observation& o : ego.observations())
    if (residual_px(T, o, {camera.focal_px, camera.baseline_m}) < parameters.estimator.inlier_px)
      draw(o.x + camera.cu_px, o.y + camera.cv_px, o.x_current - o.x, o.y_current - o.y, kGreen);
  write(file, image);
}

}  // namespace takt::command
