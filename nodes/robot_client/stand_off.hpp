// SPDX-License-Identifier: Apache-2.0
// From where the objects of an action are within reach, how to get there, and how long that takes.
#pragma once
#include "nodes/navigation/pilot.hpp"

namespace takt::robot_client {

using navigation::Disc;
using navigation::PathOutcome;
using navigation::PathPlanner;
using navigation::Place;

/// A small disc that holds all the places; of two the smallest. At least one place.
Disc enclosing(std::span<const Place> places);

/// Whether there can be a place at most `reach_m` from each of them.
inline bool within_one_reach(std::span<const Place> places, double reach_m) {
  return enclosing(places).radius_m <= reach_m;
}

/// A way to where each of `objects` is at most `reach_m` away, in place of what `way` held; on straight lines if there
/// is no grid (`planner` null). A robot that is there already has a way without length.
PathOutcome way_to_objects(PathPlanner* planner, const Place& from, std::span<const Place> objects, double reach_m,
                           std::vector<Place>& way);
/// The same to a place.
PathOutcome way_to_place(PathPlanner* planner, const Place& from, const Place& to, std::vector<Place>& way);

/// Direction in which the objects stand, seen from there.
double direction_to(const Place& from, std::span<const Place> objects);

/// Drives ways in thought: a pilot of the same kind on a robot that does exactly what it says, kLate steps later.
/// Memory is taken by the constructor.
class Rehearsal {
 public:
  explicit Rehearsal(const navigation::PilotParameters& parameters) : pilot_(parameters) {}
  void tune(const navigation::PilotParameters& parameters) { pilot_.tune(parameters); }

  /// s from standing at `from` to where the pilot stands at the end of the way; at most kLongest_s.
  double seconds(const PlanarPose& from, std::span<const Place> way, std::optional<double> direction_rad);

  static constexpr double kLongest_s = 900;

 private:
  static constexpr double kStep_s = 1.0 / 15;
  /// Two jobs at 15 Hz and the base: from a pose to what follows from it. The end of a drive is shorter for it, since
  /// the robot goes on while the pilot says less already.
  static constexpr size_t kLate = 3;

  navigation::Pilot pilot_;
};

}  // namespace takt::robot_client
