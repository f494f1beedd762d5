// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

#include "nodes/laser_fusion/generated_pair.hpp"

namespace takt::command {

/// One moment seen by a laser and a stereo camera, from a folder with KITTI's raw data: velodyne.bin, image_02.png and
/// image_03.png (rectified), calib_cam_to_cam.txt, calib_velo_to_cam.txt. The laser's points within 40 degrees of
/// straight ahead and 14 up and down, about what the camera sees; the stereo node's (semi-global matching) in the frame
/// of the left camera; both 3 to 20 m ahead: beyond, half a pixel is more than half a metre. Throws
/// std::invalid_argument naming the file.
laser_fusion::CloudPair read_laser_stereo(const std::filesystem::path& folder);

}  // namespace takt::command
