// SPDX-License-Identifier: Apache-2.0
// Sensor models: true state of the simulation -> what a sensor would report. Pure functions of the instant and the
// seed.
#pragma once
#include <span>

#include "hal/base/mobile_base.hpp"
#include "hal/laser/laser_scanner.hpp"
#include "hal/sim/simulation.hpp"
#include "rt/msg/geometry.hpp"

namespace takt::sim {

struct LaserModel {
  uint32_t beams = 181;
  double fov_rad = 3.14159265358979323846;
  double max_range_m = 8.0;
  double sigma_m = 0.01;
  double sweep_s = 0.00666;  ///< half a turn at 75 Hz (D-1.9)
  Transform sensor_in_robot;
};

/// A sweep whose first beam leaves at `first_ns`; each beam from where the robot then is, to what else moves or changes
/// as it is at the first. 0 where there is no return. `met`: of Simulation::make_snapshot(), used again and again.
void scan(const Simulation& simulation, const LaserModel& model, int64_t first_ns, std::span<float> range_m,
          Snapshot& met);

struct OdometryModel {
  double scale_error = 0.01;        ///< of distance, systematic
  double turn_bias_rad_s = 0.0005;  ///< standard deviation of the start value of the yaw-rate bias
  double turn_bias_walk = 0.0002;   ///< rad/s per sqrt(s): random walk of the bias
  double turn_scale_error = 0.01;
};

/// Wheel odometry that drifts: the true motion between ticks of 10 ms, scaled and biased, added up in a frame that
/// starts at zero with the robot's true heading removed. Depends on epoch, seed and instant only; asking for an
/// earlier instant is right but slow (starts anew).
class DriftingOdometry {
 public:
  DriftingOdometry(const Simulation& simulation, const OdometryModel& model, uint64_t seed);
  void restart();
  BaseReading at(int64_t at_ns);

 private:
  void step();
  const Simulation& simulation_;
  OdometryModel model_;
  uint64_t seed_;
  int64_t tick_ = 0;
  double x_ = 0, y_ = 0, theta_ = 0, bias_ = 0;
  RobotState previous_;
};

}  // namespace takt::sim
