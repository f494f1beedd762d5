// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>

#include "nodes/stereo/rectify.hpp"

namespace takt::stereo {

/// Reads the calibration of a raw stereo pair.
///
///     const StereoCalibration c = read_calibration("rigs/xb3.yaml");
///
/// - OpenCV: YAML, JSON or XML with M1, D1, M2, D2, R, T (metres) and image_size [width, height]; 4, 5, 8, 12 or 14
///   distortion coefficients
/// - ROS: the camera_info of the left camera; that of the right one lies next to it, with `right` (or 1) where the name
///   has `left` (or 0)
/// - Kalibr: a camchain: cam0 is left, cam1 right; pinhole with radtan or none
/// - EuRoC: mav0/cam0/sensor.yaml; cam1/sensor.yaml is the right camera
///
/// Throws std::invalid_argument naming file, line, key and value: for a form that is none of these, coefficients that
/// are none of OpenCV's (fisheye), numbers that do not fit their matrix, and what check_calibration() refuses.
StereoCalibration read_calibration(const std::filesystem::path& file);

/// The matrices and distortions alone (M1, D1, M2, D2), as OpenCV's samples keep them in a file of their own. Throws as
/// read_calibration().
StereoCalibration read_intrinsics(const std::filesystem::path& file);

/// Writes OpenCV's form, with one line of comment; five coefficients where the others are zero. Throws
/// std::invalid_argument naming the file.
void write_calibration(const std::filesystem::path& file, const StereoCalibration& calibration,
                       const std::string& comment);

}  // namespace takt::stereo
