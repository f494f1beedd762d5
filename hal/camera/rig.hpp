// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <filesystem>
#include <string>

#include "hal/device.hpp"
#include "rt/msg/geometry.hpp"

namespace takt {

/// Geometry of a stereo camera: lens, sensor and place on the robot. Read from rigs/NAME.yaml.
struct StereoRig {
  std::string model;
  int width = 640, height = 480, channels = 3;
  double hfov_rad = 0;
  double baseline_m = 0;
  double focal_px = 0, cu_px = 0, cv_px = 0;  ///< f = (W / 2) / tan(hfov / 2); centre of the image (R-0.3)
  bool rectified = true;
  std::array<double, 5> distortion{};  ///< k1 k2 p1 p2 k3 (Brown); used only if not rectified
  std::array<double, 3>
      right_rotation_rad{};          ///< misalignment of the right camera about its x, y, z; only if not rectified
  double x_m = 0, y_m = 0, z_m = 0;  ///< left optical centre in the robot frame; also the pivot of the head
  double pan_rad = 0, tilt_rad = 0, roll_rad = 0;  ///< mounting angles: pan left positive, tilt up positive
  bool on_head = false;                            ///< pan and tilt of the head are added

  /// Model of the rectified pair; zero if the rig delivers raw images.
  CameraModel camera() const { return rectified ? CameraModel{focal_px, cu_px, cv_px, baseline_m} : CameraModel{}; }
};

/// Errors name file:line and the key at fault.
tl::expected<StereoRig, DeviceError> load_rig(const std::string& device_id, const std::filesystem::path& file);

/// Left camera (x right, y down, z forward) in the robot frame (x right, y forward, z up) for these head angles.
Transform camera_in_robot(const StereoRig& rig, double head_pan_rad, double head_tilt_rad);

}  // namespace takt
