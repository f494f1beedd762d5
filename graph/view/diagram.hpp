// SPDX-License-Identifier: Apache-2.0
// What a picture of a graph shows, as plain data: one box per device and node, one line per edge. All pictures (SVG,
// Graphviz, text) are drawn from this.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "graph/language/catalogue.hpp"
#include "graph/language/graph.hpp"
#include "graph/language/registry.hpp"
#include "rt/node.hpp"

namespace takt::view {

struct DiagramInput {
  std::string name;
  int depth = 1;
  std::optional<int64_t> max_age_ns;
  int join = -1;          ///< number of the join group that it belongs to, -1: none
  bool releases = false;  ///< its producer's output releases the node (`on`)

  /// "depth 4, max_age 150 ms"; "" if the edge asks for neither.
  std::string latch_text() const;
};

struct DiagramOutput {
  std::string name, type;
  bool read = false;  ///< some edge of this graph reads it
};

struct DiagramBox {
  std::string id, type;  ///< of a device: kind and driver
  std::string release;   ///< "15 Hz", "on stereo.disparity, every 5"
  std::string times;     ///< "budget 25 ms, deadline 80 ms"
  bool device = false, high = false;
  size_t room = 0;
  std::vector<DiagramInput> inputs;  ///< connected ones, in the order of their producers
  std::vector<DiagramOutput> outputs;
};

/// Indexes into Diagram::boxes and the inputs and outputs there.
struct DiagramEdge {
  size_t from_box = 0, output = 0, to_box = 0, input = 0;
  bool control = false;  ///< requests to stop, start or pace a node
};

struct DiagramChain {
  std::string name, from, to;
  int64_t max_age_ns = 0;
};

struct Diagram {
  std::string name, subtitle;
  std::vector<std::string> rooms;  ///< rooms[kDeviceRoom] are the devices, then the subsystems
  std::vector<DiagramBox> boxes;
  std::vector<DiagramEdge> edges;
  std::vector<DiagramChain> chains;

  static constexpr size_t kDeviceRoom = 0;
  std::string from_text(const DiagramEdge& edge) const;  ///< "stereo.disparity"
  std::string to_text(const DiagramEdge& edge) const;    ///< "ego_motion.disparity"
  const std::string& type_of(const DiagramEdge& edge) const { return boxes[edge.from_box].outputs[edge.output].type; }
  const DiagramInput& input_of(const DiagramEdge& edge) const { return boxes[edge.to_box].inputs[edge.input]; }
};

/// `graph` must have been loaded with these types and devices. Edges from what the mode leaves out are not shown.
Diagram make_diagram(const graph::GraphSpec& graph, const Registry& registry);

/// "66.67 ms", "1.5 s", "250 us".
std::string time_text(int64_t ns);

/// Deadline of a node or device after its planned release: as stated, else one period of its own or of its producer;
/// nothing if neither is known.
std::optional<int64_t> deadline_ns(const graph::GraphSpec& graph, const std::string& id);

}  // namespace takt::view
