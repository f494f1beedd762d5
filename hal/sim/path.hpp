// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "hal/sim/world.hpp"

namespace takt::sim {

/// Pose and speed of the robot; theta is the driving direction from the map's x axis (C-9).
struct RobotState {
  double x_m = 0, y_m = 0, theta_rad = 0;
  double speed_m_s = 0, turn_rad_s = 0;
  bool operator==(const RobotState&) const = default;
};

/// A drive along waypoints: a cubic spline with continuous curvature (closed for a loop), passed at the requested speed
/// or slower where the turn rate or the acceleration limit asks for it. The state is a pure function of time.
class Path {
 public:
  Path() = default;
  explicit Path(const PathRequest& request);

  bool empty() const { return spline_.empty(); }
  /// `t_s` after the start; before it the robot stands at the first waypoint.
  RobotState at(double t_s) const;
  double length_m() const { return length_; }
  double lap_s() const { return lap_.time.empty() ? 0 : lap_.time.back(); }

 private:
  struct Segment {
    double x[4], y[4];  ///< cubic in the local parameter 0..1
  };
  struct Profile {
    std::vector<double> time, speed;  ///< at every sample
  };
  struct Point {
    double x, y, dx, dy, curvature;
  };
  Point point(double u) const;
  Profile profile(const PathRequest& request, double start_speed, double end_speed) const;

  std::vector<Segment> spline_;
  std::vector<double> distance_;  ///< arc length at every sample
  bool loop_ = false;
  double length_ = 0;
  Profile first_, lap_;
};

}  // namespace takt::sim
