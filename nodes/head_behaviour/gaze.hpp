// SPDX-License-Identifier: Apache-2.0
// Whom the robot looks at, and how its head must stand for that (thesis App. A; ).
#pragma once
#include <optional>
#include <span>

#include "nodes/mapping_3d/head_at.hpp"
#include "nodes/mapping_3d/pose.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/state_archive.hpp"

namespace takt::head_behaviour {

struct GazeParameters {
  double pan_max_rad = 2.05, tilt_max_rad = 0.75;
  double near_m = 3;        ///< who comes so near becomes the partner; the nearest first
  double leave_m = 3.5;     ///< who is farther away is none any more
  double step_m = 0.7;      ///< a face is the partner's if it is at most so far from where his was last
  double hold_s = 1.5;      ///< he may be unseen for so long
  double still_rad = 0.05;  ///< the head stands still while the partner is at most so far beside where it looks
};

/// The pan and tilt of the head with which the optical axis of a camera on it, whose pose is `at_rest` in the robot
/// frame at pan = tilt = 0, goes through a place; not limited.
mapping_3d::HeadAngles angles_towards(const Transform& at_rest, const mapping_3d::Position& place);

/// One thread at a time; allocates nothing.
class Gaze {
 public:
  explicit Gaze(const GazeParameters& parameters) : parameters_(parameters) {}
  void tune(const GazeParameters& parameters) { parameters_ = parameters; }

  /// Faces in the robot frame as they are seen now. `now_ns` never less than in the call before.
  void see(std::span<const mapping_3d::Position> faces, int64_t now_ns);
  /// Nobody is seen now, or nobody looks.
  void wait(int64_t now_ns);

  /// The partner's face where it was last seen; none: nobody deals with the robot.
  const std::optional<mapping_3d::Position>& partner() const { return partner_; }
  /// How the head is to stand, within its limits; straight ahead without a partner.
  mapping_3d::HeadAngles look(const Transform& camera_at_rest);
  void remember(StateArchive& archive) { TAKT_STATE(archive, partner_, seen_ns_, angles_); }

 private:
  GazeParameters parameters_;
  std::optional<mapping_3d::Position> partner_;
  int64_t seen_ns_ = 0;
  mapping_3d::HeadAngles angles_;
};

}  // namespace takt::head_behaviour
