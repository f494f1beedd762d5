// SPDX-License-Identifier: Apache-2.0
// What a plug-in registers, as data: for a process that must know it and must not load it.
//
//   const std::string text = describe(before, registry);  // in a child, which has loaded it
//   Descriptions descriptions(known);                      // in the supervisor of a run
//   descriptions.add(text);
#pragma once
#include <deque>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "graph/language/message_types.hpp"
#include "graph/language/registry.hpp"

namespace takt::plugin {

/// The node types, device kinds, drivers and message types that `after` has and `before` has not, as JSON. Makes a node
/// of each type, and throws what that throws; std::invalid_argument for a parameter of a class that Takt does not have.
std::string describe(const Registry& before, const Registry& after);

/// Adds what was described to a registry: node types and device kinds whose nodes have ports and parameters, are set up
/// nowhere and run nowhere, and message types without functions (rt/msg/layout.hpp). Outlives the use of the registry.
class Descriptions {
 public:
  explicit Descriptions(Registry& registry);
  /// Throws nlohmann::json's exception if the text is not one of describe().
  void add(const std::string& text);

 private:
  struct OwnType {
    std::vector<Field> fields;
    MessageType type;
  };
  void add_type(const nlohmann::json& type);
  void add_node(const nlohmann::json& node);
  void add_kind(const nlohmann::json& kind);
  void add_driver(const nlohmann::json& driver);

  Registry& registry_;
  std::deque<nlohmann::json> texts_;  ///< names and docs lie here
  std::deque<OwnType> own_;
  graph::MessageTypes types_;
};

}  // namespace takt::plugin
