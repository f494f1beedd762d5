// SPDX-License-Identifier: Apache-2.0
// Inside the replay camera: where known recordings keep their images, times and calibration.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "rt/msg/geometry.hpp"

namespace takt::replay {

struct RecordingLayout {
  std::filesystem::path left, right;  ///< folders of images
  std::filesystem::path calibration;  ///< rows of projection matrices; empty: the images are not rectified
  std::string left_row, right_row;    ///< "P0:"
  std::filesystem::path times;        ///< need not be there; empty: the names of the images are ns
  std::vector<std::string> left_out;
};

/// Takt's own form (image_l, image_r), KITTI odometry, KITTI raw or EuRoC, by the folders that are there; nothing if it
/// is none of them.
std::optional<RecordingLayout> find_layout(const std::filesystem::path& directory);

/// Whether the folder is a TUM RGB-D recording: colour and depth of one camera.
bool is_rgbd(const std::filesystem::path& directory);

/// What calib.txt of Middlebury's sets from 2014 on says of the left camera (baseline in m). Nothing if the file is
/// none of theirs. `left_out` gets what is not applied.
std::optional<CameraModel> middlebury_camera(const std::filesystem::path& calibration,
                                             std::vector<std::string>& left_out);

}  // namespace takt::replay
