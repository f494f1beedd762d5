// SPDX-License-Identifier: Apache-2.0
// Drives with the truth beside them: recorded ones in memory, and generated ones. For `takt eval scan_matching`, the
// benchmark and the tests.
#pragma once
#include <cstdint>
#include <random>
#include <vector>

#include "nodes/scan_matching/scan_points.hpp"

namespace takt::scan_matching {

struct DriveScan {
  double time_s = 0;
  PlanarPose odometry, truth;  ///< of the robot, each in a frame of its own
};

struct Drive {
  double first_angle_rad = 0, step_rad = 0;
  PlanarPose sensor_in_robot;
  size_t beams = 0;
  std::vector<float> range_m;  ///< scans x beams
  std::vector<DriveScan> scans;

  Sweep sweep(size_t scan) const {
    return {first_angle_rad, step_rad, {range_m.data() + scan * beams, beams}, sensor_in_robot};
  }
  /// The robot at `scan` in its frame of the scan before, by odometry and in truth.
  PlanarPose moved(size_t scan) const { return between(scans[scan - 1].odometry, scans[scan].odometry); }
  PlanarPose moved_truly(size_t scan) const { return between(scans[scan - 1].truth, scans[scan].truth); }
};

/// A straight wall.
struct Wall {
  double x0_m, y0_m, x1_m, y1_m;
};

/// Distance to the nearest wall from (x, y) in direction `angle` from the x axis; 0: none within range_max_m.
double distance_m(const std::vector<Wall>& walls, double x_m, double y_m, double angle_rad, double range_max_m);

/// A room of 12 x 9 m with boxes at its walls, drawn by the seed; the 4 x 3 m in its middle are free.
std::vector<Wall> furnished_room(uint64_t seed);
/// Two parallel walls along y, 2 m apart and 2 km long.
std::vector<Wall> corridor();

struct DriveParameters {
  size_t beams = 181;
  double field_rad = 3.14159265358979;
  double range_max_m = 30;
  double noise_m = 0.01;                                    ///< of a range, standard deviation
  double odometry_noise = 0.05, odometry_noise_rad = 0.01;  ///< share of the distance; of a turn, standard deviations
  double interval_s = 0.2;
};

/// What a scanner at the robot's centre sees.
void cast(const std::vector<Wall>& walls, const PlanarPose& robot, const DriveParameters& parameters,
          std::mt19937_64& random, std::vector<float>& range_m);

/// The poses `truth` driven between the walls: scans and odometry with their noise.
Drive make_drive(const std::vector<Wall>& walls, const std::vector<PlanarPose>& truth,
                 const DriveParameters& parameters, uint64_t seed);

/// Rounds of an ellipse in the middle of the furnished room: 0.1 m and up to 5 degrees a step.
std::vector<PlanarPose> rounds(size_t poses);

}  // namespace takt::scan_matching
