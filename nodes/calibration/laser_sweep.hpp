// SPDX-License-Identifier: Apache-2.0
// Sweeps of laser scanners on a robot that turns on the spot (thesis Sec. 4.4.1), and the file that they are recorded
// in.
#pragma once
#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "nodes/laser_fusion/pose_parameters.hpp"
#include "rt/msg/point.hpp"

namespace takt::calibration {

using laser_fusion::PoseParameters, laser_fusion::Rigid;

struct LaserReturn {
  double heading_rad = 0;  ///< of the robot, counter-clockwise
  double angle_rad = 0;    ///< of the beam in the scanner's plane, counter-clockwise from its forward axis (y)
  double range_m = 0;
  bool on_object = false;  ///< on the object of known height, cut out by hand
};

struct LaserSweep {
  std::string name;
  PoseParameters mount{};  ///< scanner in the robot frame, as far as known
  std::vector<LaserReturn> returns;
};

struct LaserRecording {
  double object_height_m = 0;
  std::vector<LaserSweep> sweeps;  ///< the first is the reference
};

/// In the frame of the scanner, whose plane is z = 0.
Eigen::Vector3d in_scanner(const LaserReturn& r);
/// Where it lies in the robot frame at heading 0, m.
Eigen::Vector3d in_room(const LaserReturn& r, const Rigid& mount);
/// Of every step-th return.
std::vector<Point> in_room(const LaserSweep& sweep, const Rigid& mount, size_t step = 1);

/// n, if every n-th of `count` is to be taken, and at most `most` of them.
inline size_t stride(size_t count, size_t most) { return std::max<size_t>(1, (count + most - 1) / most); }

/// Reads lines of these words; # begins a comment.
///   object HEIGHT                        m
///   scanner NAME X Y Z YAW PITCH ROLL    m and deg, as far as known
///   beams FIRST STEP                     deg: angles of the beams of all scans that follow
///   scan HEADING RANGE...                deg, m; of the scanner named last
/// A range of 0: nothing came back; one with an asterisk behind it (1.204*) lies on the object. Throws
/// std::invalid_argument naming file, line and what was expected there, or which scanner lacks what.
LaserRecording read_laser_recording(const std::filesystem::path& file);

/// Beams of all sweeps: angles of the first and from one to the next.
struct BeamAngles {
  double first_rad = 0, step_rad = 0;
};
/// Writes that file, ranges to 0.1 mm: a line for each heading, in the order of the returns. Throws
/// std::invalid_argument if it cannot be written.
void write_laser_recording(const std::filesystem::path& file, const LaserRecording& recording, const BeamAngles& beams);

}  // namespace takt::calibration
