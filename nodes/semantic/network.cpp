// SPDX-License-Identifier: Apache-2.0
#include "nodes/semantic/network.hpp"

#include <algorithm>

namespace takt::semantic {

std::string_view to_string(Kind kind) {
  constexpr std::string_view kNames[] = {"object", "attribute", "type", "action"};
  return kNames[static_cast<size_t>(kind)];
}

std::string_view to_string(NetworkError error) {
  switch (error) {
    case NetworkError::name: return "a name has 1 to 31 characters";
    case NetworkError::name_taken: return "another node has this name";
    case NetworkError::kinds:
      return "may not be connected; valid are object - attribute, object - type, attribute - type, attribute - action, "
             "type - action";
    case NetworkError::outside: return "lies outside of the map";
    case NetworkError::full: break;
  }
  return "the network is full; give it a larger capacity";
}

NodeSet::NodeSet(size_t most) {
  items_.reserve(most);
  merged_.reserve(most);
}

void NodeSet::add(std::span<const NodeId> ascending) {
  if (ascending.empty()) return;
  if (items_.empty() || items_.back() < ascending.front()) {
    items_.insert(items_.end(), ascending.begin(), ascending.end());
    return;
  }
  merged_.clear();
  std::set_union(items_.begin(), items_.end(), ascending.begin(), ascending.end(), std::back_inserter(merged_));
  items_.swap(merged_);
}

bool NodeSet::contains(NodeId node) const { return std::binary_search(items_.begin(), items_.end(), node); }

// Growth leaves a quarter of the slices' memory filled, each link lies in two slices, and no slice is shorter than
// four.
Network::Network(const NetworkCapacity& capacity)
    : most_(capacity.nodes), links_(8 * capacity.links + 4 * kKinds * capacity.nodes) {
  nodes_.reserve(most_);
  free_.reserve(most_);
  by_name_.reserve(most_);
}

std::vector<NodeId>::const_iterator Network::place(std::string_view name) const {
  return std::lower_bound(by_name_.begin(), by_name_.end(), name,
                          [&](NodeId node, std::string_view wanted) { return this->name(node) < wanted; });
}

NodeId Network::find(std::string_view name) const {
  const auto found = place(name);
  return found != by_name_.end() && this->name(*found) == name ? *found : kNoNode;
}

tl::expected<NodeId, NetworkError> Network::add(Kind kind, std::string_view name) {
  if (name.empty() || name.size() > kLongestName) return tl::make_unexpected(NetworkError::name);
  const auto before = place(name);
  if (before != by_name_.end() && this->name(*before) == name) return tl::make_unexpected(NetworkError::name_taken);
  if (size() == most_) return tl::make_unexpected(NetworkError::full);
  NodeId id = end();
  if (free_.empty()) {
    nodes_.emplace_back();
  } else {
    id = free_.back();
    free_.pop_back();
  }
  Node& node = nodes_[id];
  node = {};
  node.kind = kind;
  node.exists = true;
  name.copy(node.name, kLongestName);
  by_name_.insert(before, id);
  return id;
}

tl::expected<void, NetworkError> Network::connect(NodeId a, NodeId b) {
  if (!connectable(kind(a), kind(b))) return tl::make_unexpected(NetworkError::kinds);
  auto& of_a = nodes_[a].links[at(kind(b))];
  if (!links_.insert(of_a, b)) return tl::make_unexpected(NetworkError::full);
  if (links_.insert(nodes_[b].links[at(kind(a))], a)) return {};
  links_.erase(of_a, b);
  return tl::make_unexpected(NetworkError::full);
}

void Network::remove(NodeId id) {
  Node& node = nodes_[id];
  for (Slices::Slice& slice : node.links) {
    for (const NodeId other : links_.items(slice)) links_.erase(nodes_[other].links[at(node.kind)], id);
    links_.release(slice);
  }
  by_name_.erase(place(node.name));
  node.exists = false;
  free_.push_back(id);
}

bool Network::connected(NodeId a, NodeId b) const {
  const auto neighbours = omega(a, kind(b));
  return std::binary_search(neighbours.begin(), neighbours.end(), b);
}

void Network::psi(NodeId node, Kind wanted, NodeSet& into) const {
  // All sixteen rows: the neighbours, and between objects and what types have also those through types.
  const auto of_types = [](Kind k) { return k == Kind::attribute || k == Kind::action; };
  const Kind own = kind(node);
  into.clear();
  into.add(omega(node, wanted));
  if ((own == Kind::object && of_types(wanted)) || (wanted == Kind::object && of_types(own)))
    for (const NodeId type : omega(node, Kind::type)) into.add(omega(type, wanted));
}

}  // namespace takt::semantic
