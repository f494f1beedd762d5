// SPDX-License-Identifier: Apache-2.0
// From goals to a plan, in portions that fit into jobs: where actions are done from, what driving between these places
// takes, then the planner.
#pragma once
#include "nodes/planner/planner.hpp"
#include "nodes/robot_client/knowledge.hpp"
#include "nodes/robot_client/stand_off.hpp"
#include "rt/state_archive.hpp"

namespace takt::robot_client {

struct DeliberationParameters {
  double reach_m = 0.75;
  planner::PlannerParameters planner{planner::Method::best, {8, 4, 10'000}, {20'000, 160'000, 20'000}};
  navigation::PilotParameters pilot;
  size_t most_cells = 0;           ///< of a grid
  size_t cells_a_portion = 5'000;  ///< looked at by searches for ways; the one under way is ended
  size_t most_portions = 60;       ///< then the best plan so far is the plan
};

/// Where one or several actions can be done from.
struct StandOff {
  std::vector<NodeId> objects;  ///< ascending
  Place place;
  double direction_rad = 0;  ///< towards the objects
  bool reachable = false;
  void remember(StateArchive& archive) { TAKT_STATE(archive, objects, place, direction_rad, reachable); }
};

/// Takes memory in begin() and for plans. One thread at a time.
class Deliberation {
 public:
  Deliberation(const Knowledge& knowledge, const DeliberationParameters& parameters);
  /// From the next portion on; the planner's and the size of grids stay as they were.
  void tune(DeliberationParameters parameters);

  /// The error names what cannot be meant. `ways` null: straight lines.
  tl::expected<void, std::string> begin(std::span<const planner::Goal> goals, const PlanarPose& robot,
                                        const planner::ActionCosts& costs);
  /// One portion; true once plan() is there. The planner looks at the same grid in all of them, or a newer one.
  bool go_on(PathPlanner* ways, const planner::Effort& effort);

  const planner::Domain& domain() const { return domain_; }
  const planner::Plan& plan() const { return planner_.best_so_far(); }
  size_t portions() const { return portions_; }
  /// "bottle_3 cannot be got at" where that may be why there is no plan; empty where all can.
  std::string out_of_reach() const;
  /// What is thought about may take kRoom; the search for a plan has its own.
  void remember(StateArchive& archive) {
    TAKT_STATE(archive, stage_, robot_, domain_, stand_offs_, from_robot_ns_, at_, next_, portions_);
    archive.room(kRoom);
    planner_.remember(archive, domain_);
  }

 private:
  enum class Stage : uint8_t { stand_offs, travel, search };
  static constexpr size_t kRoom = 1'000'000;  ///< bytes
  size_t places() const { return domain_.places.size(); }
  int64_t& travel_ns(size_t from, size_t to) { return domain_.travel_table_ns[from * places() + to]; }
  void find_stand_offs();
  bool stand_off(PathPlanner* ways);
  void place_actions();
  bool travel(PathPlanner* ways);
  void close_table();

  const Knowledge& knowledge_;
  DeliberationParameters parameters_;
  planner::Planner planner_;
  Rehearsal rehearsal_;
  Stage stage_ = Stage::stand_offs;
  PlanarPose robot_;
  planner::Domain domain_;
  std::vector<StandOff> stand_offs_;
  std::vector<int64_t> from_robot_ns_;  ///< by stand-off
  std::vector<uint32_t> at_;            ///< by action: its stand-off
  size_t next_ = 0;                     ///< of the stage's work
  size_t portions_ = 0;
  std::vector<Place> way_;
};

}  // namespace takt::robot_client
