// SPDX-License-Identifier: Apache-2.0
#include "nodes/body_pose/picture.hpp"

#include <functional>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "nodes/mapping_3d/pose.hpp"

namespace takt::body_pose {
namespace {

using Place = std::function<std::optional<cv::Point>(const Eigen::Vector3f&)>;

cv::Scalar colour_of(const Link& link) {
  if (link.name.ends_with("_left")) return {60, 220, 60};
  if (link.name.ends_with("_right")) return {60, 60, 255};
  return {40, 220, 255};
}

void line(cv::Mat& out, const Place& place, const Eigen::Vector3f& from, const Eigen::Vector3f& to,
          const cv::Scalar& colour, int thickness) {
  const auto a = place(from), b = place(to);
  if (a && b) cv::line(out, *a, *b, colour, thickness, cv::LINE_AA);
}

void draw(cv::Mat& out, const Place& place, const Skeleton& skeleton, const DetectedBody& body) {
  const Fit& fit = body.fit;
  for (const Pointer& pointer : skeleton.pointers) {
    const Eigen::Vector3f along = pointing_direction(fit, pointer), from = fit.ends[pointer.to];
    if (along.squaredNorm() > 0) line(out, place, from, from + 0.5f * along, {255, 120, 40}, 1);
  }
  for (size_t i = 1; i < skeleton.links.size(); ++i) {
    const Link& link = skeleton.links[i];
    if (fit.fitted[i]) line(out, place, fit.ends[link.parent], fit.ends[i], colour_of(link), 2);
  }
  if (const auto head = place(fit.ends[0])) cv::circle(out, *head, 5, {255, 255, 255}, 2, cv::LINE_AA);
}

cv::Mat from_above(std::span<const Point> points, int side, const Skeleton& skeleton,
                   std::span<const DetectedBody> bodies) {
  constexpr double kRange_m = 5;
  const double scale = side / kRange_m;
  cv::Mat out(side, side, CV_8UC3, cv::Scalar(30, 30, 30));
  const Place place = [&](const Eigen::Vector3f& p) {
    return cv::Point(cvRound(side / 2.0 + p.x() * scale), cvRound(side - p.y() * scale));
  };
  const cv::Rect inside(0, 0, side, side);
  for (const Point& p : points) {
    const auto at = *place({p.x, p.y, p.z});
    if (!inside.contains(at)) continue;
    const auto height = static_cast<uint8_t>(std::clamp(70 + 80 * p.z, 50.0f, 255.0f));
    out.at<cv::Vec3b>(at) = {height, height, height};
  }
  for (const DetectedBody& body : bodies) draw(out, place, skeleton, body);
  return out;
}

}  // namespace

cv::Mat draw_bodies(const cv::Mat& image, const CameraModel& camera, const Transform& camera_in_floor,
                    std::span<const Point> points, const Skeleton& skeleton, std::span<const DetectedBody> bodies) {
  const mapping_3d::Affine a = mapping_3d::to_affine(camera_in_floor);
  const auto axis = [&](const Eigen::Vector3f& p, int column) {  // of the camera
    double sum = 0;
    for (int row = 0; row < 3; ++row) sum += a.r[3 * row + column] * (p[row] - a.t[row]);
    return sum;
  };
  const Place place = [&](const Eigen::Vector3f& p) -> std::optional<cv::Point> {
    const double depth = axis(p, 2);
    if (depth < 0.1) return std::nullopt;
    return cv::Point(cvRound(camera.cu_px + camera.focal_px * axis(p, 0) / depth),
                     cvRound(camera.cv_px + camera.focal_px * axis(p, 1) / depth));
  };
  cv::Mat left = image.clone(), both;
  for (const DetectedBody& body : bodies) draw(left, place, skeleton, body);
  cv::hconcat(left, from_above(points, image.rows, skeleton, bodies), both);
  return both;
}

}  // namespace takt::body_pose
