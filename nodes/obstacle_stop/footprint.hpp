// SPDX-License-Identifier: Apache-2.0
// The robot seen from above and what it keeps free around itself: one figure for who stops it and who plans its ways.
// Robot frame: x right, y forward (driving direction).
#pragma once
#include <algorithm>
#include <cmath>

namespace takt::obstacle_stop {

/// The robot is |x| <= half_width, -rear <= y <= front, all positive; no obstacle may come nearer to it than `margin_m`
/// (0 or more).
struct Footprint {
  double half_width_m = 0, front_m = 0, rear_m = 0;
  double margin_m = 0;

  /// From the robot's centre: with no obstacle nearer than that it may turn as it likes.
  double clearance_m() const { return std::hypot(half_width_m, std::max(front_m, rear_m)) + margin_m; }
};

/// Of a robot whose centre is its middle.
inline Footprint footprint(double width_m, double length_m, double margin_m) {
  return {width_m / 2, length_m / 2, length_m / 2, margin_m};
}

/// Thesis App. A.1; the margin holds what of a person sticks out farther than the shins that a laser scanner sees
/// (0.095 m: hal/sim).
constexpr double kRobotWidth_m = 0.56, kRobotLength_m = 0.78, kMargin_m = 0.10;

}  // namespace takt::obstacle_stop
