// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "hal/device.hpp"
#include "rt/msg/geometry.hpp"

namespace takt::replay {

/// A recorded sequence of stereo pairs: the list of its files and everything that is known before an image is decoded.
struct StereoFiles {
  std::vector<std::filesystem::path> left, right;
  std::vector<int64_t> stamp_ns;  ///< since the first frame; empty without times.txt
  CameraModel camera;             ///< zero: not rectified or unknown
  bool rectified = true;
  std::vector<std::string> left_out;  ///< see ReadsFiles
};

/// A recording as find_layout() knows them. Takt's own form, as an example: image_l/ and image_r/ (in numeric order,
/// same number and same names), calib.txt with rows P0 and P1 (3 x 4, row-major; P1(0,3) = -f B), times.txt optional
/// (read_frame_times()).
tl::expected<StereoFiles, DeviceError> list_directory(const std::string& device_id,
                                                      const std::filesystem::path& directory);

/// Left and right image of a directory in Middlebury's layout: im2 and im6, im3 and im4, im0 and im1, or view1 and
/// view5; nothing if it is none. Such a directory says nothing of the camera.
std::optional<std::pair<std::filesystem::path, std::filesystem::path>> middlebury_pair(
    const std::filesystem::path& directory);

/// Refuses files that are not complete PNG (ends with IEND), JPEG (ends with EOI), PGM, PPM, BMP or TIFF images; looks
/// at the first and last bytes only.
tl::expected<void, std::string> check_complete(const std::filesystem::path& file);

}  // namespace takt::replay
