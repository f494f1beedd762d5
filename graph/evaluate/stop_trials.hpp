// SPDX-License-Identifier: Apache-2.0
// Trials of the obstacle stop: a robot drives through the simulated yard of graph/yard.yaml, by the real nodes in
// virtual time, and somebody steps in its way whom only its laser can see. Lengths in m, times in s.
#pragma once
#include <cstdint>
#include <string_view>

#include "graph/language/graph.hpp"
#include "graph/language/registry.hpp"
#include "hal/device_types.hpp"
#include "hal/sim/simulation.hpp"
#include "rt/node.hpp"

namespace takt::command {

/// What he does: stands there all at once; walks in from the side and stops; walks across; walks up to the robot. The
/// latter two do not stop for anything.
enum class Walk : uint8_t { stands, steps_in, crosses, walks_up };
inline constexpr size_t kWalks = 4;
std::string_view to_string(Walk walk);

/// What else runs on the CPUs: nothing; loads that use up to six times their budgets; loads of which each has a job
/// that does not return.
enum class Vision : uint8_t { absent, overloaded, hanging };
inline constexpr size_t kVisions = 3;
std::string_view to_string(Vision vision);

/// Drawn by seed and number alone. Places in the robot frame (x right, y forward) of the instant at which he appears.
struct StopTrial {
  double speed_m_s = 0, turn_rad_s = 0;  ///< that the robot wants all the time
  Walk walk = Walk::stands;
  double appears_s = 0;  ///< since the epoch
  double x_m = 0, y_m = 0;
  double heading_rad = 0;  ///< counter-clockwise from y: where he faces and walks to
  double pace_m_s = 0;     ///< 0: he stands
  double stops_after_s = 0;
};
StopTrial draw_trial(uint64_t seed, uint64_t number);

/// How near he first was when the laser could see a part of him in the robot's lane: the strip that the robot with its
/// margin sweeps as it drives on.
enum class Distance : uint8_t {
  far,           ///< at least stopping_distance() from the scanner, and he does not come nearer to that place
  near,          ///< nearer
  comes_nearer,  ///< far, but then he walks nearer than that
  aside,         ///< never in the lane while the robot moved
};
inline constexpr size_t kDistances = 4;
std::string_view to_string(Distance distance);

/// v^2 / (2 a) + 0.25 v + 0.3 m with a = 1 m/s2: from there on nobody may be touched.
double stopping_distance(double speed_m_s);

struct StopOutcome {
  Distance distance = Distance::aside;
  bool contact = false;       ///< his body and the robot's touched while it moved faster than 0.05 m/s
  bool unavoidable = false;   ///< so they would if it braked as stopping_distance() says from when he was first seen so
  double impact_m_s = 0;      ///< the robot's speed then
  double least_gap_m = 0;     ///< between the two while the robot moved so
  uint64_t chain_misses = 0;  ///< deadlines of laser, base and obstacle_stop
  uint64_t vision_misses = 0;  ///< of the others
};

/// Runs trials one after the other, each in a world of its own. `yard` as it is loaded in the mode that suits `vision`.
class StopTrials {
 public:
  StopTrials(graph::GraphSpec yard, Vision vision, uint64_t seed);
  /// Throws std::runtime_error if the graph cannot be composed.
  StopOutcome run(const StopTrial& trial);

 private:
  graph::GraphSpec yard_;
  const Vision vision_;
  const uint64_t seed_;
  const Registry registry_;
  const std::shared_ptr<const sim::TextureSet> textures_;  ///< kept, so that the worlds of all trials share them
};

}  // namespace takt::command
