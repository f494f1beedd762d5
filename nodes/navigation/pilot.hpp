// SPDX-License-Identifier: Apache-2.0
// The behaviours of the base (thesis App. A; ): drive along a way to a place, rotate, drive
// straight ahead; speeds and accelerations within limits.
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "nodes/navigation/path_planner.hpp"
#include "rt/state_archive.hpp"
#include "rt/transform/planar_pose.hpp"

namespace takt::navigation {

struct MotionLimits {
  double speed_m_s = 0.8, acceleration_m_s2 = 0.6;
  double turn_rad_s = 0.8, turn_acceleration_rad_s2 = 1.2;
};

struct PilotParameters {
  MotionLimits limits;
  /// Speed wanted per m, or rad, that is left near the end. With the time T from a pose to what follows from it, more
  /// than about 0.4 / T swings.
  double gain = 1.6;
  double arrived_m = 0.02, arrived_rad = 0.01;  ///< so near is there
  double look_ahead_m = 0.5;                    ///< point of the way that it steers for
  double turn_first_rad = 0.6;                  ///< a place farther to the side is turned to before driving on
  size_t most_places = 1024;                    ///< of a way
};

struct Velocity {
  double speed_m_s = 0, turn_rad_s = 0;
};

enum class Behaviour : uint8_t { stand, drive_to, rotate, straight_ahead };

/// Poses: theta is the driving direction from the map's x axis (C-9). Memory is taken by the
/// constructor. One thread at a time.
class Pilot {
 public:
  explicit Pilot(const PilotParameters& parameters);
  /// From the next step() on; ways stay as long as they could be.
  void tune(PilotParameters parameters) {
    parameters.most_places = parameters_.most_places;
    parameters_ = parameters;
  }

  /// Ends what is going on; the speed falls within its limits.
  void stand() { behaviour_ = Behaviour::stand; }
  /// The robot stands, whatever it was told: what goes on goes on from there, and speeds rise from 0.
  void halt() { sent_ = {}; }
  /// Along the corners of a way, its first being where the robot is, to the last; turns to `direction_rad` there if
  /// one is given. False: too many corners; the behaviour before goes on.
  bool drive_to(std::span<const Place> way, std::optional<double> direction_rad = std::nullopt);
  /// By an angle from `robot` on, left positive, of any number of turns.
  void rotate(const PlanarPose& robot, double by_rad);
  /// Along the direction of `robot`; backwards if negative.
  void straight_ahead(const PlanarPose& robot, double by_m);

  /// What the base is to do until the next call, `dt_s` after the one before.
  Velocity step(const PlanarPose& robot, double dt_s);

  Behaviour behaviour() const { return behaviour_; }
  bool standing() const { return behaviour_ == Behaviour::stand && sent_.speed_m_s == 0 && sent_.turn_rad_s == 0; }
  /// What is left of the way, from the corner that it heads for.
  std::span<const Place> way_left() const { return std::span(way_).subspan(std::min(corner_, way_.size())); }
  void remember(StateArchive& archive) {
    TAKT_STATE(archive, behaviour_, way_, corner_, direction_rad_, turning_, begin_, left_, last_theta_rad_, sent_);
  }

 private:
  Velocity wanted(const PlanarPose& robot);
  Velocity follow(const PlanarPose& robot);
  Velocity turn(const PlanarPose& robot);
  Velocity ahead(const PlanarPose& robot);
  /// Share of the speed while the way leads off to the side by an angle: it answers late, and would leave the way.
  double in_line(double aside_rad) const;
  /// How fast it may be at a corner of the way; 0 at its end.
  double corner_m_s(size_t corner) const;
  double approach_m_s(double left_m) const;
  double approach_rad_s(double left_rad) const;

  PilotParameters parameters_;
  Behaviour behaviour_ = Behaviour::stand;
  std::vector<Place> way_;
  size_t corner_ = 0;  ///< that it heads for
  std::optional<double> direction_rad_;
  bool turning_ = false;  ///< towards the way, before driving on
  PlanarPose begin_;      ///< where straight_ahead began
  double left_ = 0;       ///< to rotate, or of straight_ahead in all
  double last_theta_rad_ = 0;
  Velocity sent_;
};

}  // namespace takt::navigation
