// SPDX-License-Identifier: Apache-2.0
// The semantic network: objects, attributes, types and actions, and which are connected (thesis Sec. 5.2.1;
//
#pragma once
#include <string_view>
#include <tl/expected.hpp>

#include "nodes/semantic/slices.hpp"
#include "rt/state_archive.hpp"

namespace takt::semantic {

enum class Kind : uint8_t { object, attribute, type, action };
constexpr size_t kKinds = 4;
std::string_view to_string(Kind kind);

/// Whether two kinds may be connected (thesis Tab. 5.1).
constexpr bool connectable(Kind a, Kind b) {
  return a != b && !(a == Kind::object && b == Kind::action) && !(a == Kind::action && b == Kind::object);
}

/// Place of a node in the network; a removed node's goes to a later one.
using NodeId = uint32_t;
constexpr NodeId kNoNode = std::numeric_limits<NodeId>::max();
constexpr size_t kLongestName = 31;

enum class NetworkError : uint8_t { name, name_taken, kinds, outside, full };
/// What is wrong, and what is valid.
std::string_view to_string(NetworkError error);

/// Nodes in ascending order, each once. Memory for as many as the constructor is told.
class NodeSet {
 public:
  explicit NodeSet(size_t most);
  void clear() { items_.clear(); }
  void add(std::span<const NodeId> ascending);
  bool contains(NodeId node) const;
  std::span<const NodeId> items() const { return items_; }

 private:
  std::vector<NodeId> items_, merged_;
};

struct NetworkCapacity {
  size_t nodes = 1000, links = 4000;
};

/// Memory is taken by the constructor. Ids given to a function must be those of nodes that exist. One thread at a time.
class Network {
 public:
  explicit Network(const NetworkCapacity& capacity);

  /// The name has 1..31 characters and is no other node's.
  tl::expected<NodeId, NetworkError> add(Kind kind, std::string_view name);
  /// Both ways; nothing changes if they are connected. `kinds`: Tab. 5.1 does not allow it.
  tl::expected<void, NetworkError> connect(NodeId a, NodeId b);
  /// With its links.
  void remove(NodeId node);

  bool exists(NodeId node) const { return node < nodes_.size() && nodes_[node].exists; }
  Kind kind(NodeId node) const { return nodes_[node].kind; }
  std::string_view name(NodeId node) const { return nodes_[node].name; }
  NodeId find(std::string_view name) const;  ///< kNoNode: there is none
  bool connected(NodeId a, NodeId b) const;

  /// Neighbours of one kind, ascending (Eq. 5.3, 5.4); valid until the network changes.
  std::span<const NodeId> omega(NodeId node, Kind kind) const { return links_.items(nodes_[node].links[at(kind)]); }
  /// What belongs to a node directly or through types (Eq. 5.5a to 5.5p), in place of what `into` held.
  void psi(NodeId node, Kind kind, NodeSet& into) const;

  size_t size() const { return by_name_.size(); }
  size_t capacity() const { return most_; }
  /// Ids are below this; not each is in use.
  NodeId end() const { return static_cast<NodeId>(nodes_.size()); }
  void remember(StateArchive& archive) {
    TAKT_STATE(archive, nodes_, free_, by_name_, links_);
    if (nodes_.size() > most_) archive.fail();
  }

 private:
  struct Node {
    char name[kLongestName + 1] = {};
    Kind kind = Kind::object;
    bool exists = false;
    std::array<Slices::Slice, kKinds> links;
  };
  static size_t at(Kind kind) { return static_cast<size_t>(kind); }
  std::vector<NodeId>::const_iterator place(std::string_view name) const;

  size_t most_;
  std::vector<Node> nodes_;
  std::vector<NodeId> free_, by_name_;
  Slices links_;
};

}  // namespace takt::semantic
