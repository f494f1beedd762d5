// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <opencv2/core.hpp>
#include <span>

#include "nodes/body_pose/body_detector.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/point.hpp"

namespace takt::body_pose {

/// What a person judges a result by: the image with the skeletons in it, left sides green, right sides red, the rest
/// yellow, pointing rays blue; beside it the cloud from above, ahead up, with the same. `image` is what `camera` sees
/// (BGR; its focal length in pixels of this image), points and bodies are in the floor frame.
cv::Mat draw_bodies(const cv::Mat& image, const CameraModel& camera, const Transform& camera_in_floor,
                    std::span<const Point> points, const Skeleton& skeleton, std::span<const DetectedBody> bodies);

}  // namespace takt::body_pose
