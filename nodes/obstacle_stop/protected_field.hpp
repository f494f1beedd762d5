// SPDX-License-Identifier: Apache-2.0
// The area that the robot sweeps while it comes to a stand, and the returns of a laser scan in it.
// Robot frame: x right, y forward (driving direction), z up. Pure functions, no allocation, any thread.
#pragma once
#include "nodes/obstacle_stop/footprint.hpp"
#include "nodes/obstacle_stop/sweep.hpp"

namespace takt::obstacle_stop {

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

/// What a robot may be doing before a stop takes effect: of each speed the wanted one, if that is faster the same way
/// or the robot stands, else the present one, from which it has to slow down first.
Drive drive_before_stop(const Drive& present, const Drive& wanted);

/// All places that come to within the margin of the footprint while it moves for `time_s` at constant speeds: along a
/// line, or along the circle about (-speed / turn, 0). What it leaves behind is not among them: a place in the margin
/// beyond the edge that trails, on a line or a circle wider than the robot, as the robot only gets farther from it.
class ProtectedField {
 public:
  ProtectedField(const Footprint& footprint, const Drive& drive, double time_s);
  /// The border belongs to the field. False for a coordinate that is not finite.
  bool contains(double x_m, double y_m) const;
  /// Nothing farther from the origin is in the field.
  double reach_m() const { return reach_m_; }

 private:
  /// Whether the place lies within the margin of the footprint, this being longer by so much at either end.
  bool in_margin(double x_m, double y_m, double longer_rear_m, double longer_front_m) const;
  bool left_behind(double x_m, double y_m) const;
  bool swept_to(double x_m, double y_m, double from_rad) const;
  bool arc_meets_edge(double radius_m, double from_rad) const;
  bool arc_meets_corner(double radius_m, double from_rad) const;

  Footprint footprint_;
  double distance_m_;      ///< signed, along the path
  double angle_rad_;       ///< signed turn on the way
  bool straight_;          ///< as good as
  double centre_x_m_ = 0;  ///< of the circle
  double reach_m_;
};

struct FieldReading {
  bool blocked = false;
  double nearest_m = 0;  ///< least range of the returns that block; 0: none
  bool blinded = false;  ///< as could_hide() says
};

/// Blocked if at least `beams_min` (>= 1) neighbouring beams return from the field: a lone one is dust or a reflection.
FieldReading read_field(const Sweep& sweep, const ProtectedField& field, int beams_min);

/// Whether something so wide could stand in the field, and only blinded beams point at it: neighbouring ones, the gap
/// between the two that see being that wide there. Ranges are tried every 5 cm.
bool could_hide(const Sweep& sweep, const ProtectedField& field, double width_m);

}  // namespace takt::obstacle_stop
