// SPDX-License-Identifier: Apache-2.0
// What the client knows: a semantic map of its own, from a predefined network, from what is reported and what it is
// told.
#pragma once
#include <array>

#include "nodes/navigation/path_planner.hpp"
#include "nodes/planner/domain.hpp"
#include "nodes/robot_client/task.hpp"
#include "nodes/semantic/semantic_map.hpp"
#include "rt/state_archive.hpp"

namespace takt::robot_client {

using semantic::kNoNode;
using semantic::NodeId;

constexpr size_t kMostRoles = 4;  ///< of an action that can be commanded

/// One action with its objects, as commanded: role by role, kNoNode behind the last.
struct Deed {
  NodeId action = kNoNode;
  std::array<NodeId, kMostRoles> objects{kNoNode, kNoNode, kNoNode, kNoNode};
};

/// An object as somebody reports it, by name. Places in the map frame.
struct Report {
  std::string_view name, type;
  double x_m = 0, y_m = 0, confidence = 1;
  int64_t stamp_ns = 0;
};
struct ReportedState {
  std::string_view attribute, value;
};

/// Takes memory for types that it did not know, and for errors. One thread at a time.
class Knowledge {
 public:
  explicit Knowledge(const semantic::MapParameters& parameters) : map_(parameters) {}

  /// To be filled from a file.
  semantic::SemanticMap& map() { return map_; }
  const semantic::SemanticMap& map() const { return map_; }

  /// The object of that name is there and so; attributes that the network does not have, and values that they cannot
  /// have, are left out. kNoNode: the name is empty or another node's, the place lies outside of the map, or it is
  /// full.
  NodeId see(const Report& report, std::span<const ReportedState> states);

  /// A state that nobody has reported.
  void believe(const planner::Goal& fact) {
    map_.set_state(fact.object, fact.attribute, fact.value);
    ++revision_;
  }
  /// A task of the verbs add, move and remove: the sentence says what is believed now; the error what is not known, and
  /// what is. Ids of what is removed are given to others.
  tl::expected<std::string, std::string> edit(const Task& task);
  /// Forgets all objects but those of these names.
  void keep_only(std::span<const std::string_view> names);
  /// Rises with whatever is reported or believed.
  uint32_t revision() const { return revision_; }

  /// The error names what is not known, and what is.
  tl::expected<planner::Goal, std::string> understand(const FactText& fact) const;
  tl::expected<NodeId, std::string> object_named(std::string_view name) const;
  /// An action and an object for each of its roles.
  tl::expected<Deed, std::string> understand(std::span<const std::string> words) const;

  std::span<const NodeId> objects_of(const Deed& deed) const {
    return std::span(deed.objects).first(map_.action(deed.action).roles.size());
  }
  std::vector<navigation::Place> places(std::span<const NodeId> objects) const;
  std::string_view name(NodeId node) const { return map_.network().name(node); }
  /// "fill cup_1 bottle_2".
  std::string to_text(const Deed& deed) const;
  void append(const Deed& deed, std::string& into) const;
  /// "cup_1.level=full".
  std::string to_text(const planner::Goal& fact) const;
  void remember(StateArchive& archive) { TAKT_STATE(archive, map_, revision_); }

 private:
  std::string names(semantic::Kind kind) const;

  semantic::SemanticMap map_;
  uint32_t revision_ = 1;
};

}  // namespace takt::robot_client
