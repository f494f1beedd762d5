// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/transform/pose_math.hpp>: core, experimental.
// Rigid poses with uncertainty: composition, inverse, interpolation. Plain values, no allocation.
//
// Error model: a pose child-in-parent is known up to a small translation dt and rotation dr, both along the axes of the
// *parent*: t = t_mean + dt, R = Exp(dr) R_mean. The covariance is of (dt, dr), order x y z rx ry rz, m and rad,
// row-major and symmetric. Propagation is first order, the two factors of a composition taken as independent
// (Smith, Self, Cheeseman, "Estimating Uncertain Spatial Relationships in Robotics", 1990: compounding and reversal).
#pragma once
#include <array>

#include "rt/msg/geometry.hpp"

namespace takt {

using PoseCovariance = std::array<double, 36>;

/// p_parent = R(q) p_child + t, with the covariance of its error.
struct UncertainPose {
  Transform transform;
  PoseCovariance covariance{};
};

/// c in a, from b in a and c in b.
UncertainPose compose(const UncertainPose& b_in_a, const UncertainPose& c_in_b);

/// parent in child, from child in parent.
UncertainPose inverse(const UncertainPose& child_in_parent);

/// Between two poses of the same pair of frames; fraction 0 gives `from`, 1 gives `to`. Translation is linear, rotation
/// slerp along the shorter arc, covariance linear: an upper bound, however the errors of the two are correlated
/// (E|(1-s)a + s b|^2 <= (1-s) E|a|^2 + s E|b|^2). A fraction above 1 predicts at constant motion; its covariance is
/// none.
UncertainPose interpolate(const UncertainPose& from, const UncertainPose& to, double fraction);

/// True if all numbers are finite and the quaternion is not zero.
bool is_valid(const UncertainPose& pose);

/// With a unit quaternion.
UncertainPose normalised(const UncertainPose& pose);

}  // namespace takt
