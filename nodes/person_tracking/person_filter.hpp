// SPDX-License-Identifier: Apache-2.0
// Where a person is and goes: a Kalman filter of a point that moves at constant velocity but for white noise of its
// acceleration (Bar-Shalom, Li, Kirubarajan, "Estimation with Applications to Tracking and Navigation", 2001,
// Sec. 6.2.2).
#pragma once
#include <Eigen/Core>
#include <span>

#include "nodes/person_tracking/shirt_place.hpp"
#include "rt/state_archive.hpp"

namespace takt::person_tracking {

struct FilterParameters {
  double acceleration = 1.0;  ///< power spectral density of its noise, m^2/s^3: after 1 s a speed has changed by 1 m/s
  double speed_sigma = 0.8;   ///< of the velocity in the beginning, m/s along each axis; its mean is 0
};

/// State x, y, vx, vy in m and m/s, and its covariance.
struct Estimate {
  Eigen::Vector4d state = Eigen::Vector4d::Zero();
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Identity();
  Eigen::Vector2d position() const { return state.head<2>(); }
  Eigen::Vector2d velocity() const { return state.tail<2>(); }
  void remember(StateArchive& archive) { TAKT_STATE(archive, state, covariance); }
};

/// x(t + dt) = F x(t) + w, w of covariance Q. Two steps of dt are one of 2 dt.
Eigen::Matrix4d transition(double dt_s);
Eigen::Matrix4d process_noise(const FilterParameters& p, double dt_s);

class PersonFilter {
 public:
  explicit PersonFilter(const FilterParameters& parameters) : p_(parameters) {}
  void tune(const FilterParameters& parameters) { p_ = parameters; }
  void begin(const Place& first);
  void predict(double dt_s);  ///< dt_s >= 0
  void update(const Place& seen);
  /// Squared Mahalanobis distance of a place from the one expected now; chi-square of two degrees of freedom.
  double distance2(const Place& seen) const;
  const Estimate& estimate() const { return now_; }
  Estimate after(double dt_s) const;
  void remember(StateArchive& archive) { TAKT_STATE(archive, now_); }

 private:
  FilterParameters p_;
  Estimate now_;
};

/// What was seen, `dt_s` after what was seen before.
struct TimedPlace {
  double dt_s = 0;
  Place place;
};

/// The last state, the obvious way: all states at once as the least squares of what was seen, of how they follow from
/// one another and of the first velocity. Slow. At least one place; dt_s > 0 but for the first.
Estimate filter_reference(const FilterParameters& p, std::span<const TimedPlace> seen);

}  // namespace takt::person_tracking
