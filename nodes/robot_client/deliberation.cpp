// SPDX-License-Identifier: Apache-2.0
#include "nodes/robot_client/deliberation.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace takt::robot_client {
namespace {

constexpr size_t kMostStandOffs = 64;  // the table of travel between them has its square
constexpr size_t kMostByGrid = 12;     // above, travel between them counts along straight lines
constexpr int64_t kNever_ns = 1'000'000'000'000;

int64_t ns(double s) { return std::llround(s * 1e9); }

}  // namespace

Deliberation::Deliberation(const Knowledge& knowledge, const DeliberationParameters& parameters)
    : knowledge_(knowledge), parameters_(parameters), planner_(parameters.planner), rehearsal_(parameters.pilot) {
  way_.reserve(std::max<size_t>(2, parameters.most_cells));
}

void Deliberation::tune(DeliberationParameters parameters) {
  parameters.planner = parameters_.planner;
  parameters.most_cells = parameters_.most_cells;
  parameters_ = parameters;
  rehearsal_.tune(parameters.pilot);
}

tl::expected<void, std::string> Deliberation::begin(std::span<const planner::Goal> goals, const PlanarPose& robot,
                                                    const planner::ActionCosts& costs) {
  planner::DomainParameters parameters;
  parameters.within_reach = [&](std::span<const NodeId> objects) {
    return objects.size() <= kMostRoles && within_one_reach(knowledge_.places(objects), parameters_.reach_m);
  };
  auto domain = planner::ground(knowledge_.map(), goals, {robot.x_m, robot.y_m}, parameters, costs);
  if (!domain) return tl::make_unexpected(domain.error());
  domain_ = std::move(*domain);
  robot_ = robot;
  portions_ = next_ = 0;
  find_stand_offs();
  if (stand_offs_.size() > kMostStandOffs)
    return tl::make_unexpected(
        fmt::format("what could help would have to be done at {} places, more than the {} that "
                    "can be compared; name the objects in a nearer goal",
                    stand_offs_.size(), kMostStandOffs));
  stage_ = Stage::stand_offs;
  return {};
}

/// Actions on the same objects are done from one place.
void Deliberation::find_stand_offs() {
  stand_offs_.clear();
  at_.clear();
  for (const planner::GroundAction& action : domain_.actions) {
    std::vector<NodeId> objects = action.objects;
    std::sort(objects.begin(), objects.end());
    const auto known =
        std::find_if(stand_offs_.begin(), stand_offs_.end(), [&](const StandOff& s) { return s.objects == objects; });
    at_.push_back(static_cast<uint32_t>(known - stand_offs_.begin()));
    if (known == stand_offs_.end()) stand_offs_.push_back({std::move(objects), {}, 0, false});
  }
  from_robot_ns_.assign(stand_offs_.size(), kNever_ns);
}

bool Deliberation::go_on(PathPlanner* ways, const planner::Effort& effort) {
  ++portions_;
  const auto time_is_up = [&] { return effort.time_is_up && effort.time_is_up(); };
  for (size_t cells = 0; stage_ != Stage::search; cells += ways != nullptr ? ways->expanded() : 1) {
    if (cells >= parameters_.cells_a_portion || time_is_up()) return false;
    if (stage_ == Stage::stand_offs ? stand_off(ways) : travel(ways)) continue;
    next_ = 0;
    if (stage_ == Stage::stand_offs) {
      place_actions();
      stage_ = Stage::travel;
    } else {
      close_table();
      stage_ = Stage::search;
      planner_.begin(domain_, effort);
    }
  }
  return planner_.go_on(effort) || portions_ >= parameters_.most_portions;
}

/// The next one; false after the last.
bool Deliberation::stand_off(PathPlanner* ways) {
  if (next_ == stand_offs_.size()) return false;
  StandOff& stand_off = stand_offs_[next_];
  const auto objects = knowledge_.places(stand_off.objects);
  stand_off.reachable =
      way_to_objects(ways, {robot_.x_m, robot_.y_m}, objects, parameters_.reach_m, way_) == PathOutcome::found;
  if (stand_off.reachable) {
    stand_off.place = way_.back();
    stand_off.direction_rad = direction_to(stand_off.place, objects);
    from_robot_ns_[next_] = ns(rehearsal_.seconds(robot_, way_, stand_off.direction_rad));
  }
  ++next_;
  return true;
}

/// Actions are done at their stand-offs, place 1 + its number; those that cannot be got to are left out. A goal is
/// where an action gives it, whichever of them is nearest.
void Deliberation::place_actions() {
  auto& actions = domain_.actions;
  size_t kept = 0;
  for (size_t i = 0; i < actions.size(); ++i) {
    if (!stand_offs_[at_[i]].reachable) continue;
    actions[i].places.assign(1, at_[i] + 1);
    if (kept != i) actions[kept] = std::move(actions[i]);
    ++kept;
  }
  actions.resize(kept);
  domain_.find_achievers();
  domain_.places.resize(1);
  for (const StandOff& stand_off : stand_offs_) domain_.places.push_back({stand_off.place.x_m, stand_off.place.y_m});
  for (size_t i = 0; i < domain_.goals.size(); ++i) {
    domain_.goal_places[i] = static_cast<uint32_t>(places());
    domain_.places.push_back(domain_.places[0]);
  }
  domain_.travel_table_ns.assign(places() * places(), kNever_ns);
  for (size_t i = 0; i < places(); ++i) travel_ns(i, i) = 0;
  for (size_t i = 0; i < stand_offs_.size(); ++i) travel_ns(0, i + 1) = from_robot_ns_[i];
}

/// From the next stand-off to another; false after the last. The robot stands as the action before left it, and stops
/// where it first reaches the objects, as it will.
bool Deliberation::travel(PathPlanner* ways) {
  const size_t n = stand_offs_.size();
  const auto wanted = [&](size_t pair) {
    return pair / n != pair % n && stand_offs_[pair / n].reachable && stand_offs_[pair % n].reachable;
  };
  while (next_ < n * n && !wanted(next_)) ++next_;
  if (next_ == n * n) return false;
  const size_t i = next_ / n, j = next_ % n;
  ++next_;
  const StandOff& from = stand_offs_[i];
  const auto objects = knowledge_.places(stand_offs_[j].objects);
  if (way_to_objects(n <= kMostByGrid ? ways : nullptr, from.place, objects, parameters_.reach_m, way_) !=
      PathOutcome::found)
    return true;
  travel_ns(i + 1, j + 1) = ns(rehearsal_.seconds({from.place.x_m, from.place.y_m, from.direction_rad}, way_,
                                                  direction_to(way_.back(), objects)));
  return true;
}

/// No detour is shorter than the direct way; then the goals.
void Deliberation::close_table() {
  const size_t n = stand_offs_.size() + 1;
  for (size_t via = 0; via < n; ++via)
    for (size_t from = 0; from < n; ++from)
      for (size_t to = 0; to < n; ++to)
        travel_ns(from, to) = std::min(travel_ns(from, to), travel_ns(from, via) + travel_ns(via, to));
  for (size_t g = 0; g < domain_.goals.size(); ++g) {
    const planner::Fact& goal = domain_.goals[g];
    const uint32_t place = domain_.goal_places[g];
    const auto& achievers = domain_.variables[goal.variable].achievers[goal.value];
    for (size_t other = 0; other < n; ++other) {
      int64_t there = achievers.empty() ? 0 : kNever_ns, back = there;
      for (const uint32_t action : achievers) {
        there = std::min(there, travel_ns(other, domain_.actions[action].places[0]));
        back = std::min(back, travel_ns(domain_.actions[action].places[0], other));
      }
      travel_ns(other, place) = there;
      travel_ns(place, other) = back;
    }
  }
}

std::string Deliberation::out_of_reach() const {
  std::string text;
  for (const StandOff& stand_off : stand_offs_) {
    if (stand_off.reachable || stage_ == Stage::stand_offs) continue;
    text += text.empty() ? "cannot be got at: " : "; ";
    for (size_t i = 0; i < stand_off.objects.size(); ++i)
      text.append(i == 0 ? "" : " with ").append(knowledge_.name(stand_off.objects[i]));
  }
  return text;
}

}  // namespace takt::robot_client
