// SPDX-License-Identifier: Apache-2.0
// A sweep of a level scanner as plain data, and its returns seen from above. Pure functions, no allocation, any thread.
#pragma once
#include <cmath>
#include <span>

#include "rt/msg/geometry.hpp"

namespace takt::obstacle_stop {

/// Angles as in LaserScan.
struct Sweep {
  double first_angle_rad = 0, step_rad = 0;
  Transform sensor_in_robot;
  std::span<const float> range_m;  ///< 0: no return; NaN: the beam is blinded

  double angle_rad(size_t beam) const { return first_angle_rad + static_cast<double>(beam) * step_rad; }
};

/// In the robot frame, unless another one is named.
struct PlanarPoint {
  double x_m = 0, y_m = 0;
};

/// The robot frame's x and y of the sensor's x and y axes (from the quaternion), and the sensor's place.
struct PlaneTransform {
  double xx, xy, yx, yy, x, y;

  explicit PlaneTransform(const Transform& t)
      : xx(1 - 2 * (t.qy * t.qy + t.qz * t.qz)),
        xy(2 * (t.qx * t.qy + t.qw * t.qz)),
        yx(2 * (t.qx * t.qy - t.qw * t.qz)),
        yy(1 - 2 * (t.qx * t.qx + t.qz * t.qz)),
        x(t.x),
        y(t.y) {}

  /// Where the beam is at that range.
  PlanarPoint place(const Sweep& sweep, size_t beam, double range) const {
    // Counter-clockwise from the sensor's forward axis, which is its y.
    const double angle = sweep.angle_rad(beam), right = -range * std::sin(angle), ahead = range * std::cos(angle);
    return {xx * right + yx * ahead + x, xy * right + yy * ahead + y};
  }
};

}  // namespace takt::obstacle_stop
