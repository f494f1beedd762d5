// SPDX-License-Identifier: Apache-2.0
// What motion is to be expected before the images are compared, and how far it may be off: the answer where they say
// nothing (R-8.2, step 6).
#pragma once
#include <cstdint>
#include <optional>

#include "nodes/ego_motion/rigid.hpp"
#include "rt/state_archive.hpp"
#include "rt/transform/pose_math.hpp"

namespace takt::ego_motion {

struct ExpectationParameters {
  double acceleration_m_s2 = 1.0;         ///< standard deviation; ACE's base reaches 1.35
  double turn_acceleration_rad_s2 = 2.0;  ///< standard deviation; its head reaches more
  double odometry_error = 0.1;            ///< standard deviation, share of the motion that the odometry gives
};

/// Motions are camera_in_previous.
class Expectation {
 public:
  Expectation() = default;
  explicit Expectation(const ExpectationParameters& parameters) : p_(parameters) {}
  void tune(const ExpectationParameters& parameters) { p_ = parameters; }

  /// What the last motion would be over `interval_ns`: constant velocity. None before the first one.
  std::optional<Rigid> continued(int64_t interval_ns) const;
  /// Expected over `interval_ns`: the odometry where it is known, else the last motion continued, else none. The
  /// variance after constant velocity is what a constant acceleration a leaves: v is known as the mean of the last
  /// measured interval m, so after a time t without measurement the error of the position is a t (t + m) / 2. Of a
  /// sequence of unmeasured steps each one gives the increase, so that their sum is right.
  UncertainPose motion(int64_t interval_ns, const std::optional<Rigid>& odometry) const;

  void measured(const Rigid& motion, int64_t interval_ns);
  void unmeasured(int64_t interval_ns, const std::optional<Rigid>& odometry);
  void remember(StateArchive& archive) { TAKT_STATE(archive, last_, known_, last_s_, measured_s_, unseen_s_); }

 private:
  ExpectationParameters p_;
  Rigid last_;
  bool known_ = false;
  double last_s_ = 0;      ///< interval that `last_` took
  double measured_s_ = 0;  ///< the last interval measured
  double unseen_s_ = 0;    ///< since then
};

}  // namespace takt::ego_motion
