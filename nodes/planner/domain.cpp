// SPDX-License-Identifier: Apache-2.0
#include "nodes/planner/domain.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <unordered_map>  // replay: looked up below, never walked through

namespace takt::planner {
namespace {

using semantic::Action;
using semantic::Clause;
using semantic::Kind;
using semantic::SemanticMap;
using semantic::Value;

class Grounder {
 public:
  Grounder(const SemanticMap& map, const DomainParameters& parameters, const ActionCosts& costs)
      : map_(map),
        parameters_(parameters),
        costs_(costs),
        action_nodes_(map.all(Kind::action)),
        set_(map.network().capacity()) {}

  tl::expected<Domain, std::string> run(std::span<const Goal> goals, const Place& robot) {
    domain_.cost_mode = parameters_.cost_mode;
    domain_.travel = parameters_.travel ? parameters_.travel : straight_lines(parameters_.speed_m_s);
    domain_.places.push_back(robot);
    for (const Goal& goal : goals) {
      if (const std::string wrong = fault(goal); !wrong.empty()) return tl::make_unexpected(wrong);
      domain_.goals.push_back(want(goal.object, goal.attribute, goal.value));
      domain_.goal_places.push_back(place(goal.object));
    }
    while (!wanted_.empty() && !too_many_) {
      const Fact fact = wanted_.back();
      wanted_.pop_back();
      achieve(domain_.variables[fact.variable].object, domain_.variables[fact.variable].attribute,
              Value(domain_.variables[fact.variable].values[fact.value]));
    }
    if (too_many_)
      return tl::make_unexpected(
          fmt::format("the roles of actions can be filled in more than {} ways; ask for less, or raise most_actions",
                      parameters_.most_actions));
    finish();
    return std::move(domain_);
  }

 private:
  std::string fault(const Goal& goal) {
    const auto& network = map_.network();
    if (!network.exists(goal.object) || network.kind(goal.object) != Kind::object) return "a goal names no object";
    network.psi(goal.object, Kind::attribute, set_);
    if (!set_.contains(goal.attribute)) {
      std::vector<std::string_view> names;
      for (const NodeId node : set_.items()) names.push_back(network.name(node));
      return fmt::format("{} has no attribute that the goal names; valid are: {}", network.name(goal.object),
                         fmt::join(names, ", "));
    }
    if (!fits(map_.attribute(goal.attribute), goal.value))
      return fmt::format("{} of {} cannot have the goal's value; valid: {}", network.name(goal.attribute),
                         network.name(goal.object), describe(map_.attribute(goal.attribute)));
    return "";
  }

  // Numbers ----------------------------------------------------------------------------------------------------------

  static uint64_t key(NodeId object, NodeId attribute) { return uint64_t{object} << 32 | attribute; }

  uint32_t place(NodeId object) {
    const auto [known, added] = places_.try_emplace(object, static_cast<uint32_t>(domain_.places.size()));
    if (added) domain_.places.push_back({map_.object(object).x_m, map_.object(object).y_m});
    return known->second;
  }
  uint32_t number(Variable& variable, const Value& value) {
    const auto at = std::find(variable.values.begin(), variable.values.end(), value);
    if (at != variable.values.end()) return static_cast<uint32_t>(at - variable.values.begin());
    variable.values.push_back(value);
    return static_cast<uint32_t>(variable.values.size() - 1);
  }
  /// The fact by number; new ones are pursued.
  Fact want(NodeId object, NodeId attribute, const Value& value) {
    const auto [known, added] =
        variables_.try_emplace(key(object, attribute), static_cast<uint32_t>(domain_.variables.size()));
    if (added) domain_.variables.push_back({object, attribute, {map_.state(object, attribute)}, {}});
    const Fact fact{known->second, number(domain_.variables[known->second], value)};
    if (pursued_.insert({fact.variable, fact.value}).second) wanted_.push_back(fact);
    return fact;
  }

  // Roles ------------------------------------------------------------------------------------------------------------

  /// Every action that gives this value to this object, in every way to fill its other roles.
  void achieve(NodeId object, NodeId attribute, const Value& value) {
    map_.network().psi(object, Kind::action, set_);
    const std::vector<NodeId> actions(set_.items().begin(), set_.items().end());
    for (const NodeId node : actions) {
      const Action& action = map_.action(node);
      for (const Clause& result : action.results)
        if (result.attribute == attribute && result.value == value &&
            map_.network().connected(object, action.roles[result.role].type) && can_serve(node, result.role, object))
          fill(node, 0, result.role, object);
    }
  }

  void fill(NodeId node, uint32_t role, uint32_t bound, NodeId object) {
    const Action& action = map_.action(node);
    if (role == action.roles.size()) return add(node);
    const auto take = [&](NodeId candidate) {
      if (std::find(chosen_.begin(), chosen_.end(), candidate) != chosen_.end() || too_many_) return;
      chosen_.push_back(candidate);
      fill(node, role + 1, bound, object);
      chosen_.pop_back();
    };
    if (role == bound) return take(object);
    for (const NodeId candidate : candidates(node, role))
      if (candidate != object) take(candidate);
  }

  const std::vector<NodeId>& candidates(NodeId node, uint32_t role) {
    const auto [known, added] = candidates_.try_emplace(key(node, role));
    if (added)
      for (const NodeId object : map_.network().omega(map_.action(node).roles[role].type, Kind::object))
        if (can_serve(node, role, object)) known->second.push_back(object);
    return known->second;
  }

  /// Whether what the role requires is true, or some action can make it so: others would only be tried in vain.
  bool can_serve(NodeId node, uint32_t role, NodeId object) const {
    const auto& required = map_.action(node).required;
    return std::all_of(required.begin(), required.end(), [&](const Clause& c) {
      return c.role != role || map_.state(object, c.attribute) == c.value || can_become(object, c);
    });
  }
  bool can_become(NodeId object, const Clause& wanted) const {
    return std::any_of(action_nodes_.begin(), action_nodes_.end(), [&](NodeId node) {
      const Action& action = map_.action(node);
      return std::any_of(action.results.begin(), action.results.end(), [&](const Clause& c) {
        return c.attribute == wanted.attribute && c.value == wanted.value &&
               map_.network().connected(object, action.roles[c.role].type);
      });
    });
  }

  void add(NodeId node) {
    std::vector<NodeId> identity{node};
    identity.insert(identity.end(), chosen_.begin(), chosen_.end());
    if (!known_.insert(identity).second) return;
    if (parameters_.within_reach && !parameters_.within_reach(chosen_)) return;
    too_many_ = domain_.actions.size() == parameters_.most_actions;
    if (too_many_) return;
    const Action& action = map_.action(node);
    GroundAction ground{node, chosen_, {}, {}, {}, std::llround(costs_.cost_s(node, action.cost_s) * 1e9)};
    for (const NodeId object : chosen_) ground.places.push_back(place(object));
    for (const Clause& c : action.required) ground.required.push_back(want(chosen_[c.role], c.attribute, c.value));
    domain_.actions.push_back(std::move(ground));
  }

  /// Results, as far as they touch what matters.
  void finish() {
    const auto ascending = [](const Fact& a, const Fact& b) { return a.variable < b.variable; };
    for (GroundAction& ground : domain_.actions) {
      for (const Clause& c : map_.action(ground.action).results)
        if (const auto variable = variables_.find(key(ground.objects[c.role], c.attribute));
            variable != variables_.end())
          ground.results.push_back({variable->second, number(domain_.variables[variable->second], c.value)});
      std::sort(ground.required.begin(), ground.required.end(), ascending);
      std::sort(ground.results.begin(), ground.results.end(), ascending);
    }
    domain_.find_achievers();
  }

  const SemanticMap& map_;
  const DomainParameters& parameters_;
  const ActionCosts& costs_;
  const std::vector<NodeId> action_nodes_;
  semantic::NodeSet set_;
  Domain domain_;
  std::unordered_map<uint64_t, uint32_t> variables_;              // replay: as above
  std::unordered_map<NodeId, uint32_t> places_;                   // replay: as above
  std::unordered_map<uint64_t, std::vector<NodeId>> candidates_;  // replay: as above
  std::set<std::pair<uint32_t, uint32_t>> pursued_;
  std::set<std::vector<NodeId>> known_;
  std::vector<Fact> wanted_;
  std::vector<NodeId> chosen_;
  bool too_many_ = false;
};

}  // namespace

int64_t Domain::drive_ns(uint32_t from, const GroundAction& action) const {
  int64_t sum_ns = 0;
  for (const uint32_t place : action.places) {
    sum_ns += travel_ns(cost_mode == CostMode::faithful ? 0 : from, place);
    from = place;
  }
  return sum_ns;
}

void Domain::find_achievers() {
  for (Variable& variable : variables) variable.achievers.assign(variable.values.size(), {});
  for (uint32_t i = 0; i < actions.size(); ++i)
    for (const Fact& fact : actions[i].results) variables[fact.variable].achievers[fact.value].push_back(i);
}

Travel straight_lines(double speed_m_s) {
  return [speed_m_s](const Place& from, const Place& to) {
    return static_cast<int64_t>(std::ceil(std::hypot(to.x_m - from.x_m, to.y_m - from.y_m) / speed_m_s * 1e9));
  };
}

tl::expected<Domain, std::string> ground(const SemanticMap& map, std::span<const Goal> goals, const Place& robot,
                                         const DomainParameters& parameters, const ActionCosts& costs) {
  return Grounder(map, parameters, costs).run(goals, robot);
}

}  // namespace takt::planner
