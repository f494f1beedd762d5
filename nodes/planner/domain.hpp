// SPDX-License-Identifier: Apache-2.0
// A task as the searches see it: state variables with numbered values, actions with all roles filled, places to drive
// to (thesis Sec. 5.2.4; ). Only what can matter for the goals is in it, so that a task in a
// large network stays small. Built when a goal comes and not in a job: these functions allocate.
#pragma once
#include <functional>

#include "nodes/planner/action_costs.hpp"
#include "nodes/semantic/semantic_map.hpp"
#include "rt/state_archive.hpp"

namespace takt::planner {

/// "The attribute of the object is to have this value".
struct Goal {
  NodeId object = semantic::kNoNode, attribute = semantic::kNoNode;
  semantic::Value value;
};

/// A variable has a value, both by number.
struct Fact {
  uint32_t variable = 0, value = 0;
  bool operator==(const Fact&) const = default;
};

/// chi(object, attribute). Value 0 is that of the beginning, which may be unknown; beside it there are only those that
/// an action or a goal names.
struct Variable {
  NodeId object = semantic::kNoNode, attribute = semantic::kNoNode;
  std::vector<semantic::Value> values;
  std::vector<std::vector<uint32_t>> achievers;  ///< by value: the actions that give it
  void remember(StateArchive& archive) { TAKT_STATE(archive, object, attribute, values, achievers); }
};

/// One action with an object in each role. The robot drives to the objects in the order of the roles and is at the last
/// one's place then.
struct GroundAction {
  NodeId action = semantic::kNoNode;
  std::vector<NodeId> objects;
  std::vector<uint32_t> places;
  std::vector<Fact> required, results;  ///< ascending by variable
  int64_t cost_ns = 0;
  void remember(StateArchive& archive) { TAKT_STATE(archive, action, objects, places, required, results, cost_ns); }
};

enum class CostMode : uint8_t {
  sequential,  ///< a step's driving begins where the step before ended
  faithful,    ///< as the thesis counts: from where the robot is at the beginning, to each object
};

struct Place {
  double x_m = 0, y_m = 0;
};
/// Time between two places, ns. No detour is shorter than the direct way by more than kTravelSlack_ns.
using Travel = std::function<int64_t(const Place& from, const Place& to)>;
constexpr int64_t kTravelSlack_ns = 1000;

struct DomainParameters {
  CostMode cost_mode = CostMode::sequential;
  double speed_m_s = 0.7;         ///< along the straight line, unless there is a `travel`
  Travel travel;                  ///< as a path planner says it, for instance
  size_t most_actions = 200'000;  ///< with their roles filled
  /// Whether an action can be done with these objects where they stand, one a role; none: always.
  std::function<bool(std::span<const NodeId>)> within_reach = nullptr;
};

/// Straight lines at that speed, whole ns upwards.
Travel straight_lines(double speed_m_s);

struct Domain {
  CostMode cost_mode = CostMode::sequential;
  Travel travel;
  std::vector<Place> places;  ///< 0: the robot's at the beginning
  std::vector<Variable> variables;
  std::vector<GroundAction> actions;
  std::vector<Fact> goals;
  std::vector<uint32_t> goal_places;     ///< of the goals' objects
  std::vector<int64_t> travel_table_ns;  ///< in place of `travel`: row by row, from each place to each; may be empty

  int64_t travel_ns(uint32_t from, uint32_t to) const {
    return travel_table_ns.empty() ? travel(places[from], places[to]) : travel_table_ns[from * places.size() + to];
  }
  /// Who gives which value, found anew: after `actions` were changed.
  void find_achievers();
  /// Of an action, the robot being at `from`.
  int64_t drive_ns(uint32_t from, const GroundAction& action) const;
  /// With a travel_table_ns, or along straight lines of the usual speed.
  void remember(StateArchive& archive) {
    TAKT_STATE(archive, cost_mode, places, variables, actions, goals, goal_places, travel_table_ns);
    if (archive.loads() && !travel) travel = straight_lines(DomainParameters{}.speed_m_s);
  }
};

/// What can matter for the goals: actions that give a wanted value, whatever these require, and so on. The error names
/// the goal that cannot be meant, or the limit.
tl::expected<Domain, std::string> ground(const semantic::SemanticMap& map, std::span<const Goal> goals,
                                         const Place& robot, const DomainParameters& parameters,
                                         const ActionCosts& costs = {});

}  // namespace takt::planner
