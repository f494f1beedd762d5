// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <opencv2/core.hpp>
#include <optional>

#include "nodes/laser_fusion/generated_pair.hpp"
#include "nodes/stereo/evaluate.hpp"
#include "rt/msg/geometry.hpp"

namespace takt::command {

/// One moment seen by a laser and a stereo camera, from a folder with KITTI's raw data: velodyne.bin, image_02.png and
/// image_03.png (rectified), calib_cam_to_cam.txt, calib_velo_to_cam.txt. The laser's points within 40 degrees of
/// straight ahead and 14 up and down, about what the camera sees; the stereo node's (semi-global matching) in the frame
/// of the left camera; both 3 to 20 m ahead: beyond, half a pixel is more than half a metre. Throws
/// std::invalid_argument naming the file.
struct LaserStereo {
  laser_fusion::CloudPair pair;
  CameraModel camera;  ///< of the vision cloud
};
LaserStereo read_laser_stereo(const std::filesystem::path& folder);

/// The pair of such a folder, and what the laser says of its disparities: every point ahead in the pixel of the
/// rectified left image that it falls into, the nearest of several; 0 where none does. Throws as read_laser_stereo().
struct LaserTruth {
  cv::Mat left, right;  ///< BGR
  stereo::DisparityImage disparity;
};
LaserTruth read_laser_truth(const std::filesystem::path& folder);

/// By how much disparities of the camera's points exceed those of laser points that lie in the same pixel at the true
/// pose, from_m to to_m ahead: the median, px, over those at most 3 px apart; none if there are fewer than 100.
std::optional<double> disparity_bias_px(const LaserStereo& scene, double from_m, double to_m);

/// The vision cloud as the camera would have seen it with so much less disparity.
cloud::Cloud with_less_disparity(const cloud::Cloud& vision, const CameraModel& camera, double px);

}  // namespace takt::command
