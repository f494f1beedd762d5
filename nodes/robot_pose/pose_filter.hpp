// SPDX-License-Identifier: Apache-2.0
// One pose of the robot from several sensors that each measure how it moved: an extended Kalman filter whose state
// holds beside the present the pose at which each sensor measured last (stochastic cloning: Roumeliotis and Burdick
// 2002), and which takes late measurements at their own stamps by going back and repeating what came after.
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "nodes/scan_matching/planar.hpp"
#include "rt/state_archive.hpp"

namespace takt::robot_pose {

using scan_matching::Covariance;

/// Who measures.
enum class Source : uint8_t { wheels, ego_motion, scans };
constexpr size_t kSources = 3;

/// How the robot moved between two instants.
struct Measured {
  Source source = Source::wheels;
  int64_t from_ns = 0, to_ns = 0;
  PlanarPose robot_in_previous;                    ///< at to_ns, in the robot's frame at from_ns
  Covariance covariance = Covariance::Identity();  ///< positive definite
  bool valid = true;  ///< false: nothing was measured in this interval, the next one begins at to_ns

  void remember(StateArchive& archive) {
    TAKT_STATE(archive, source, from_ns, to_ns, robot_in_previous, covariance, valid);
  }
};

/// What became of a measurement.
enum class Taken : uint8_t {
  used,
  begun,     ///< the pose at from_ns is not kept: the source's next measurement can be used
  rejected,  ///< farther from what is expected than `gate`, or no number
  too_late,  ///< older than all that is kept, or known already
};

struct FilterParameters {
  // Spectral densities of the accelerations: after one second the speed has changed by so much (standard deviation).
  double acceleration = 0.5;       ///< m/s^2 sqrt(s)
  double turn_acceleration = 1.0;  ///< rad/s^2 sqrt(s)
  double slip = 0.01;              ///< m / sqrt(s), sideways
  double gate =
      16.27;  ///< largest normalised innovation squared; three degrees of freedom exceed it once in a thousand
  double trust_s = 1.0;                                  ///< if nothing was used for so long, the gate is open
  double begin_speed_m_s = 0.5, begin_turn_rad_s = 0.5;  ///< standard deviations at the first instant
};

/// What is known of the robot at one instant.
struct Estimate {
  int64_t stamp_ns = 0;
  PlanarPose robot_in_map;
  Covariance covariance = Covariance::Zero();  ///< of the pose
  double speed_m_s = 0, turn_rad_s = 0;
};

/// Allocates in the constructor only. One thread at a time.
class PoseFilter {
 public:
  /// `history`: measurements that can be gone back over, at least 1.
  explicit PoseFilter(const FilterParameters& parameters, size_t history = 64);
  /// From the next add() on, also for what is gone back over.
  void tune(const FilterParameters& parameters) { p_ = parameters; }

  /// Before the first measurement: the pose at its beginning.
  void begin_at(const PlanarPose& robot_in_map, const Covariance& covariance);

  /// In any order of stamps between the sources; those of one source in theirs.
  Taken add(const Measured& measured);

  bool begun() const { return begun_; }
  /// At the newest stamp that a measurement had.
  Estimate newest() const;
  /// At a stamp not before that: predicted at constant speed and turn rate.
  Estimate predicted(int64_t stamp_ns) const;
  void remember(StateArchive& archive);

 private:
  static constexpr int kNow = 5;  ///< x, y, theta, speed, turn rate
  static constexpr int kSize = kNow + 3 * static_cast<int>(kSources);
  using Vector = Eigen::Matrix<double, kSize, 1>;
  using Matrix = Eigen::Matrix<double, kSize, kSize>;

  struct State {
    int64_t stamp_ns = 0, used_ns = 0;  ///< used: when the last measurement was
    Vector mean = Vector::Zero();
    Matrix covariance = Matrix::Zero();
    std::array<int64_t, kSources> cloned_ns;  ///< when a source's last pose was; INT64_MIN: never
    void remember(StateArchive& archive) { TAKT_STATE(archive, stamp_ns, used_ns, mean, covariance, cloned_ns); }
  };
  struct Entry {
    Measured measured;
    State after;
    void remember(StateArchive& archive) { TAKT_STATE(archive, measured, after); }
  };

  void predict(State& state, int64_t stamp_ns) const;
  Taken process(State& state, const Measured& measured) const;
  bool update(State& state, const Measured& measured) const;
  static void clone(State& state, Source source);
  static Estimate estimate(const State& state);
  static bool before(const Measured& a, const Measured& b);
  const State& last() const { return entries_.empty() ? base_ : entries_.back().after; }

  FilterParameters p_;
  size_t history_;
  bool begun_ = false;
  State base_;                  ///< before the first entry
  std::vector<Entry> entries_;  ///< in the order of their stamps
};

/// Of the step that leads from `from` to `to`, two poses of one chain whose covariances were compounded of independent
/// steps (rt/transform/pose_math.hpp); along the axes of `from`.
Covariance step_covariance(const UncertainPose& from, const UncertainPose& to);

}  // namespace takt::robot_pose
