// SPDX-License-Identifier: Apache-2.0
// Where somebody points, seen from above.
#pragma once
#include <optional>
#include <span>

#include "rt/msg/ace/body_poses.hpp"

namespace takt::mission {

/// Direction in the robot frame, counter-clockwise from where the robot looks (y), in which the body whose head is
/// nearest to (x, y), at most 0.8 m, points: along its ray that is nearest to level, at most 25 degrees off. None:
/// there is no such body, or it does not point.
std::optional<double> pointed_direction(const BodyPoses& bodies, double x_m, double y_m);

/// The one of the directions that is nearest to all others (least sum of angles): what is far off does not count for
/// more than what is a little off. Not empty.
double middle_direction(std::span<const double> directions_rad);

}  // namespace takt::mission
