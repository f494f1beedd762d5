// SPDX-License-Identifier: Apache-2.0
#include "hal/sim/states.hpp"

#include <algorithm>
#include <cmath>

namespace takt::sim {

States::States(const World& world) : world_(world) {
  const size_t objects = world.objects.size();
  moves_.resize(objects);
  looks_.resize(objects);
  for (size_t i = 0; i < objects; ++i) at_first_.push_back(static_cast<ValueId>(i));
  for (const WorldObject& o : world.objects) places_.push_back({Whereabouts::Kind::at, 0, o.position, o.yaw_rad});
  for (size_t i = 0; i < objects; ++i) places_.push_back({Whereabouts::Kind::on, i, Vec2::Zero(), 0});
  for (size_t i = 0; i < world.clients.size(); ++i) places_.push_back({Whereabouts::Kind::carried, i, Vec2::Zero(), 0});
  places_.push_back({});
  add_objects();
  add_actions();
  events_.resize(at_first_.size());
  add_events();
  if (!world.actions.empty()) tracks_ = std::make_unique<Track[]>(world.clients.size() * at_first_.size());
}

void States::add_attribute(size_t object, const std::string& name) {
  if (attribute(object, name)) return;
  attributes_.push_back({object, name});
  at_first_.push_back(kUnknown);
}

ValueId States::add_text(const std::string& text) {
  if (const ValueId known = value(text); known != kUnknown) return known;
  texts_.push_back(text);
  return static_cast<ValueId>(texts_.size() - 1);
}

void States::add_objects() {
  for (size_t i = 0; i < world_.objects.size(); ++i) {
    for (const auto& [name, text] : world_.objects[i].attributes) {
      add_attribute(i, name);
      at_first_.back() = add_text(text);
    }
    for (const Look& look : world_.objects[i].looks) {
      LookRule rule{{}, &look.shape};
      for (const Condition& condition : look.when) {
        add_attribute(i, condition.attribute);
        rule.when.emplace_back(*attribute(i, condition.attribute), add_text(condition.value));
      }
      looks_[i].push_back(std::move(rule));
    }
  }
}

/// An object of a role's type has all attributes that the action asks for or gives.
void States::add_actions() {
  for (const WorldAction& action : world_.actions) {
    for (const auto* conditions : {&action.pre, &action.post})
      for (const RoleCondition& condition : *conditions) add_text(condition.value);
    for (const ActionRole& role : action.roles) {
      const auto of_role = [&](const auto& part) { return part.role == role.name; };
      const bool moved = std::any_of(action.moves.begin(), action.moves.end(), of_role);
      for (size_t i = 0; i < world_.objects.size(); ++i) {
        if (world_.objects[i].type != role.type) continue;
        for (const auto* conditions : {&action.pre, &action.post})
          for (const RoleCondition& condition : *conditions)
            if (of_role(condition)) add_attribute(i, condition.attribute);
        if (moved) moves_[i] = true;
      }
    }
  }
}

void States::add_events() {
  for (const WorldEvent& event : world_.events) {
    const auto object = this->object(event.object);
    if (!object) continue;  // the loader refuses it
    const int64_t at_ns = std::llround(event.at_s * 1e9);
    if (event.attribute.empty()) {
      moves_[*object] = true;
      ValueId where = away();
      if (!event.away) {
        where = static_cast<ValueId>(places_.size());
        places_.push_back({Whereabouts::Kind::at, 0, event.position, event.yaw_rad});
      }
      events_[place(*object)].push_back({at_ns, where});
    } else if (const auto variable = attribute(*object, event.attribute)) {
      events_[*variable].push_back({at_ns, add_text(event.value)});
    }
  }
}

std::optional<size_t> States::object(std::string_view name) const {
  for (size_t i = 0; i < world_.objects.size(); ++i)
    if (world_.objects[i].name == name) return i;
  return std::nullopt;
}

std::optional<Variable> States::attribute(size_t object, std::string_view name) const {
  for (size_t i = 0; i < attributes_.size(); ++i)
    if (attributes_[i].object == object && attributes_[i].name == name)
      return static_cast<Variable>(world_.objects.size() + i);
  return std::nullopt;
}

ValueId States::value(std::string_view text) const {
  const auto found = std::find(texts_.begin(), texts_.end(), text);
  return found == texts_.end() ? kUnknown : static_cast<ValueId>(found - texts_.begin());
}

ValueId States::at(Variable variable, int64_t since_epoch_ns) const {
  Change newest{INT64_MIN, at_first_[variable]};
  const auto& events = events_[variable];
  const auto after = std::upper_bound(events.begin(), events.end(), since_epoch_ns,
                                      [](int64_t at_ns, const Change& event) { return at_ns < event.at_ns; });
  if (after != events.begin()) newest = *(after - 1);
  for (size_t robot = 0; tracks_ && robot < world_.clients.size(); ++robot) {
    const auto change = tracks_[robot * at_first_.size() + variable].newest(since_epoch_ns);
    if (change && change->at_ns >= newest.at_ns) newest = *change;
  }
  return newest.value;
}

const Shape& States::shape(size_t object, int64_t since_epoch_ns) const {
  for (const LookRule& look : looks_[object]) {
    if (std::all_of(look.when.begin(), look.when.end(),
                    [&](const auto& wanted) { return at(wanted.first, since_epoch_ns) == wanted.second; }))
      return *look.shape;
  }
  return world_.objects[object];
}

void States::change(size_t robot, Variable variable, const Change& change) {
  tracks_[robot * at_first_.size() + variable].append(change);
}

}  // namespace takt::sim
