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

/// Drives ways in thought: a pilot of the same kind on a robot that does at once what it says. Memory is taken by the
/// constructor.
class Rehearsal {
 public:
  explicit Rehearsal(const navigation::PilotParameters& parameters) : pilot_(parameters) {}

  /// s from standing at `from` to standing at the end of the way, what a base answers late included; at most
  /// kLongest_s.
  double seconds(const PlanarPose& from, std::span<const Place> way, std::optional<double> direction_rad);

  static constexpr double kLongest_s = 900;

 private:
  static constexpr double kStep_s = 1.0 / 15;
  static constexpr double kAnswer_s = 0.2;  ///< until a base does what it is told, measured in the simulated world

  navigation::Pilot pilot_;
};

}  // namespace takt::robot_client
