// SPDX-License-Identifier: Apache-2.0
// Logs of the robot navigation toolkit CARMEN: one message a line, `NAME content ipc_time host logger_time`, metres,
// radians and seconds. Read are
//   ODOM x y theta tv rv accel
//   FLASER n r1 .. rn x y theta odom_x odom_y odom_theta
//   RAWLASER1 type start fov step max_range accuracy remission n r1 .. rn m v1 .. vm
//   ROBOTLASER1 as RAWLASER1, then laser_x laser_y laser_theta robot_x robot_y robot_theta and five more
//   PARAM robot_frontlaser_offset d
// and every other message is passed over and counted. Of the scan messages the one that comes first in the file counts.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "hal/device.hpp"
#include "rt/transform/planar_pose.hpp"

namespace takt::replay {

struct TimedPose {
  int64_t time_ns = 0;  ///< since the logger's start
  PlanarPose pose;      ///< theta is the driving direction, from the x axis
};

struct CarmenScan {
  int64_t time_ns = 0;     ///< since the logger's start
  PlanarPose odometry;     ///< of the robot, by the last ODOM line before the scan; zero if there is none
  PlanarPose logged;       ///< the x y theta of a FLASER line; of ROBOTLASER1 that of the laser; zero for RAWLASER1
  bool corrected = false;  ///< `logged` was corrected afterwards by mapping
};

/// A whole log. Times are repaired where the logger stamped lines late (late_stamps.hpp).
///
/// In a log that a mapping program has corrected, each scan is followed by an ODOM line that repeats its corrected pose
/// with a meaningless time, and by a line NEFF; the ODOM lines after it go on from the corrected pose. `odometry`
/// undoes that: it is made of the movements between ODOM lines alone, so that it drifts as the robot's odometer did.
struct CarmenLog {
  uint32_t beams = 0;
  double first_angle_rad = 0, step_rad = 0;  ///< as in ScanFormat
  double max_range_m = 0;
  double laser_ahead_m = 0;  ///< of the robot's centre, in driving direction
  std::vector<CarmenScan> scans;
  std::vector<float> range_m;  ///< scans.size() x beams, as logged
  std::vector<TimedPose> odometry;
  int64_t end_ns = 0;       ///< time of the last scan or ODOM line
  size_t late_stamps = 0;   ///< times that were replaced
  size_t without_time = 0;  ///< lines at the beginning that were left out, as nothing tells their time
  /// What was left out, replaced or guessed, a sentence each, which begins with the file.
  std::vector<std::string> left_out;
};

/// Largest log that is read, bytes. Memory is bounded by it: a range of 2 or more characters is kept in 4 bytes, an
/// ODOM line of 22 or more in 80.
constexpr uint64_t kLargestLog = 512ull << 20;

/// Errors name file:line. `device_id` is who asks. A last line that was cut off, as by a logger that was killed, is
/// left out; a range that is inf or NaN is no return. Without a line ODOM the poses of ROBOTLASER1 are the odometry.
tl::expected<CarmenLog, DeviceError> load_carmen_log(const std::string& device_id, const std::filesystem::path& file,
                                                     uint64_t largest_bytes = kLargestLog);

/// Ground truth for mapping and scan matching: the corrected pose of each scan that has one. Not for a graph: a robot
/// does not know it.
std::vector<TimedPose> corrected_poses(const CarmenLog& log);

}  // namespace takt::replay
