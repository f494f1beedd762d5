// SPDX-License-Identifier: Apache-2.0
#include "nodes/robot_client/knowledge.hpp"

#include <fmt/format.h>

namespace takt::robot_client {
namespace {

using semantic::Kind;

constexpr size_t kNamesTold = 12;  // of those that are valid

}  // namespace

NodeId Knowledge::see(const Report& report, std::span<const ReportedState> states) {
  const auto& network = map_.network();
  if (report.name.empty()) return kNoNode;
  NodeId node = network.find(report.name);
  if (node == kNoNode) {
    const auto type = map_.type_named(report.type);
    if (!type) return kNoNode;
    const auto added = map_.add_object(*type, report.x_m, report.y_m, report.name);
    if (!added) return kNoNode;
    node = *added;
    map_.object(node).first_ns = report.stamp_ns;
  } else if (network.kind(node) != Kind::object || !map_.move(node, report.x_m, report.y_m)) {
    return kNoNode;
  }
  ++revision_;
  semantic::Object& object = map_.object(node);
  object.confidence = report.confidence;
  object.seen_ns = report.stamp_ns;
  ++object.sightings;
  for (const ReportedState& state : states) {
    const NodeId attribute = network.find(state.attribute);
    if (attribute == kNoNode || network.kind(attribute) != Kind::attribute) continue;
    if (const auto value = semantic::parse_value(map_.attribute(attribute), state.value))
      map_.set_state(node, attribute, *value);
  }
  return node;
}

tl::expected<std::string, std::string> Knowledge::edit(const Task& task) {
  const std::string& object = task.words.back();
  const auto refused = [&](semantic::NetworkError error) {
    return tl::make_unexpected(
        fmt::format("{} at {:.2f} m, {:.2f} m: {}", object, task.x_m, task.y_m, to_string(error)));
  };
  if (task.verb == Verb::add) {
    const NodeId type = map_.network().find(task.words[0]);
    if (type == kNoNode || map_.network().kind(type) != Kind::type)
      return tl::make_unexpected(fmt::format("there is no type {}; known are: {}", task.words[0], names(Kind::type)));
    const auto added = map_.add_object(type, task.x_m, task.y_m, object);
    if (!added) return refused(added.error());
    map_.object(*added).confidence = 1;
    ++revision_;
    return fmt::format("{} {} is at {:.2f} m, {:.2f} m", task.words[0], object, task.x_m, task.y_m);
  }
  const auto node = object_named(object);
  if (!node) return tl::make_unexpected(node.error());
  if (task.verb == Verb::move && !map_.move(*node, task.x_m, task.y_m)) return refused(semantic::NetworkError::outside);
  if (task.verb == Verb::remove) map_.remove(*node);
  ++revision_;
  return task.verb == Verb::move ? fmt::format("{} is at {:.2f} m, {:.2f} m", object, task.x_m, task.y_m)
                                 : fmt::format("there is no {}", object);
}

void Knowledge::keep_only(std::span<const std::string_view> names) {
  for (const NodeId node : map_.all(Kind::object))
    if (std::find(names.begin(), names.end(), name(node)) == names.end()) map_.remove(node);
}

std::vector<navigation::Place> Knowledge::places(std::span<const NodeId> objects) const {
  std::vector<navigation::Place> places;
  for (const NodeId object : objects) places.push_back({map_.object(object).x_m, map_.object(object).y_m});
  return places;
}

std::string Knowledge::names(Kind kind) const {
  const auto nodes = map_.all(kind);
  std::string text;
  for (size_t i = 0; i < std::min(nodes.size(), kNamesTold); ++i)
    text += (text.empty() ? "" : ", ") + std::string(name(nodes[i]));
  if (nodes.size() > kNamesTold) text += fmt::format(" and {} more", nodes.size() - kNamesTold);
  return text.empty() ? "none" : text;
}

tl::expected<NodeId, std::string> Knowledge::object_named(std::string_view wanted) const {
  const NodeId node = map_.network().find(wanted);
  if (node != kNoNode && map_.network().kind(node) == Kind::object) return node;
  return tl::make_unexpected(fmt::format("there is no object {}; known are: {}", wanted, names(Kind::object)));
}

tl::expected<planner::Goal, std::string> Knowledge::understand(const FactText& fact) const {
  const auto object = object_named(fact.object);
  if (!object) return tl::make_unexpected(object.error());
  semantic::NodeSet attributes(map_.network().capacity());
  map_.network().psi(*object, Kind::attribute, attributes);
  const NodeId attribute = map_.network().find(fact.attribute);
  if (!attributes.contains(attribute)) {
    std::string valid;
    for (const NodeId node : attributes.items()) valid += (valid.empty() ? "" : ", ") + std::string(name(node));
    return tl::make_unexpected(
        fmt::format("{} has no attribute {}; it has: {}", fact.object, fact.attribute, valid.empty() ? "none" : valid));
  }
  const auto value = semantic::parse_value(map_.attribute(attribute), fact.value);
  if (!value) return tl::make_unexpected(fmt::format("{}.{}: {}", fact.object, fact.attribute, value.error()));
  return planner::Goal{*object, attribute, *value};
}

tl::expected<Deed, std::string> Knowledge::understand(std::span<const std::string> words) const {
  Deed deed;
  deed.action = map_.network().find(words[0]);
  if (deed.action == kNoNode || map_.network().kind(deed.action) != Kind::action)
    return tl::make_unexpected(fmt::format("there is no action {}; known are: {}", words[0], names(Kind::action)));
  const auto& roles = map_.action(deed.action).roles;
  if (roles.size() > kMostRoles || words.size() - 1 != roles.size())
    return tl::make_unexpected(
        fmt::format("{} wants {} objects, and got {}", words[0], roles.size(), words.size() - 1));
  for (size_t role = 0; role < roles.size(); ++role) {
    const auto object = object_named(words[role + 1]);
    if (!object) return tl::make_unexpected(object.error());
    if (!map_.network().connected(*object, roles[role].type))
      return tl::make_unexpected(fmt::format("{} is no {}, which {} wants as its {}", words[role + 1],
                                             name(roles[role].type), words[0], roles[role].name));
    deed.objects[role] = *object;
  }
  return deed;
}

std::string Knowledge::to_text(const Deed& deed) const {
  std::string text;
  append(deed, text);
  return text;
}

void Knowledge::append(const Deed& deed, std::string& into) const {
  into += name(deed.action);
  for (const NodeId object : objects_of(deed)) into.append(" ").append(name(object));
}

std::string Knowledge::to_text(const planner::Goal& fact) const {
  return fmt::format("{}.{}={}", name(fact.object), name(fact.attribute),
                     semantic::to_text(map_.attribute(fact.attribute), fact.value));
}

}  // namespace takt::robot_client
