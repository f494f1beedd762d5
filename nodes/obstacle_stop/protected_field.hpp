// SPDX-License-Identifier: Apache-2.0
// The area that the robot sweeps while it comes to a stand, and the returns of a laser scan in it.
// Robot frame: x right, y forward (driving direction), z up. Pure functions, no allocation, any thread.
#pragma once
#include <span>

#include "rt/msg/messages.hpp"

namespace takt::obstacle_stop {

/// The robot seen from above, margin included: |x| <= half_width, -rear <= y <= front. All positive.
struct Footprint {
  double half_width_m = 0, front_m = 0, rear_m = 0;
};

/// Speeds of the robot: along +y, and counter-clockwise from above.
struct Drive {
  double speed_m_s = 0, turn_rad_s = 0;
};

/// How the robot comes to a stand: nothing happens for `reaction_s`, then both speeds fall steadily. All positive.
struct Braking {
  double deceleration_m_s2 = 0, turn_deceleration_rad_s2 = 0, reaction_s = 0;
};

/// How long the robot would move at undiminished speeds to go as far as it goes until it stands: the reaction time plus
/// half of what the slower of the two brakings takes. Times |v| this is |v| reaction + v^2 / (2 a) for a straight
/// drive.
double stopping_time_s(const Drive& drive, const Braking& braking);

/// All places that the footprint covers while it moves for `time_s` at constant speeds: along a line, or along the
/// circle about (-speed / turn, 0).
class ProtectedField {
 public:
  ProtectedField(const Footprint& footprint, const Drive& drive, double time_s);
  /// The border belongs to the field. False for a coordinate that is not finite.
  bool contains(double x_m, double y_m) const;

 private:
  bool in_footprint(double x_m, double y_m) const;
  bool swept_to(double x_m, double y_m, double from_rad) const;
  bool arc_meets_footprint(double x_m, double y_m) const;

  Footprint footprint_;
  double distance_m_;      ///< signed, along the path
  double angle_rad_;       ///< signed turn on the way
  double centre_x_m_ = 0;  ///< of the circle
  double reach_m_;         ///< nothing farther from the origin is in the field
};

/// A sweep as plain data, angles as in LaserScan.
struct Sweep {
  double first_angle_rad = 0, step_rad = 0;
  Transform sensor_in_robot;
  std::span<const float> range_m;  ///< 0: no return
};

struct FieldReading {
  bool blocked = false;
  double nearest_m = 0;  ///< least range of the returns that block; 0: none
};

/// Blocked if at least `beams_min` (>= 1) neighbouring beams return from the field: a lone one is dust or a reflection.
FieldReading read_field(const Sweep& sweep, const ProtectedField& field, int beams_min);

}  // namespace takt::obstacle_stop
