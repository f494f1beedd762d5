// SPDX-License-Identifier: Apache-2.0
// Sweeps of two scanners whose mounts are known, in generated rooms, and how well calibration finds these.
#pragma once
#include "nodes/calibration/laser_calibration.hpp"

namespace takt::calibration {

struct GeneratedSweepParameters {
  double noise_m = 0.001;           ///< of a range, standard deviation
  int headings = 720, beams = 361;  ///< over a whole turn; over 180 degrees
};

struct GeneratedSweeps {
  LaserRecording recording;  ///< mounts as measured with a tape; x, y, yaw and pitch of the first are exact
  BeamAngles beams;
  std::vector<PoseParameters> truth;  ///< mount of each scanner
};

/// A scanner with a roll of about 45 degrees on the left, one with about -45 on the right, 0.9 m above the floor of a
/// furnished room; a pillar 1.2 m high stands 1.2 m from the robot's centre. What is known beforehand is off by up to 5
/// cm in z and 5 degrees in roll, of the second scanner also by 10 cm in x and y, 10 degrees in yaw, 5 in pitch.
/// Returns from beyond 8 m are missing.
GeneratedSweeps generate_sweeps(const GeneratedSweepParameters& parameters, uint64_t seed);

/// Of one scanner over runs with different rooms and mounts.
struct MountErrors {
  std::vector<double> position_m, rotation_rad;
};
struct CalibrationErrors {
  size_t converged = 0;
  MountErrors reference, second, between;  ///< between: of the second in the frame of the first
  std::vector<double> residual_m;
};
CalibrationErrors measure_calibration(const GeneratedSweepParameters& parameters, size_t runs, uint64_t seed);

}  // namespace takt::calibration
