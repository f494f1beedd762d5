// SPDX-License-Identifier: Apache-2.0
#include "nodes/ego_motion/expectation.hpp"

#include <algorithm>
#include <cmath>

#include "rt/time/units.hpp"

namespace takt::ego_motion {
namespace {

constexpr double kLongestGap = 10;          // a motion is not stretched further than this many intervals
constexpr double kOdometryFloor_m = 0.002;  // what an odometry that stands still may be off
constexpr double kOdometryFloor_rad = 0.001;

/// Same variance on all axes of the translation, and of the rotation.
UncertainPose with_variance(const Rigid& motion, double translation_m2, double rotation_rad2) {
  UncertainPose pose{to_transform(motion), {}};
  for (size_t axis = 0; axis < 3; ++axis) {
    pose.covariance[7 * axis] = translation_m2;
    pose.covariance[7 * (axis + 3)] = rotation_rad2;
  }
  return pose;
}

double squared(double v) { return v * v; }

}  // namespace

std::optional<Rigid> Expectation::continued(int64_t interval_ns) const {
  if (!known_) return std::nullopt;
  return scaled(last_, last_s_ > 0 ? std::clamp(to_seconds(interval_ns) / last_s_, 0.0, kLongestGap) : 1);
}

UncertainPose Expectation::motion(int64_t interval_ns, const std::optional<Rigid>& odometry) const {
  if (odometry) {
    const double angle = rotation_vector(odometry->R).norm();
    return with_variance(*odometry, squared(p_.odometry_error * odometry->t.norm() + kOdometryFloor_m),
                         squared(p_.odometry_error * angle + kOdometryFloor_rad));
  }
  const double interval_s = to_seconds(interval_ns);
  const auto error_s2 = [&](double t_s) { return 0.5 * t_s * (t_s + (known_ ? measured_s_ : interval_s)); };
  const double increase = squared(error_s2(unseen_s_ + interval_s)) - squared(error_s2(unseen_s_));
  return with_variance(continued(interval_ns).value_or(Rigid{}), squared(p_.acceleration_m_s2) * increase,
                       squared(p_.turn_acceleration_rad_s2) * increase);
}

void Expectation::measured(const Rigid& motion, int64_t interval_ns) {
  last_ = motion;
  last_s_ = measured_s_ = to_seconds(interval_ns);
  unseen_s_ = 0;
  known_ = true;
}

void Expectation::unmeasured(int64_t interval_ns, const std::optional<Rigid>& odometry) {
  if (odometry) measured(*odometry, interval_ns);
  else unseen_s_ += to_seconds(interval_ns);
}

}  // namespace takt::ego_motion
