// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "graph/view/graph_pictures.hpp"

namespace takt::view {
namespace {

/// A quoted string of the DOT language; "\n" in it starts a new line of the label.
std::string dot_string(std::string_view text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    if (c == '\n') result += "\\n";
    else result += c;
  }
  return result + "\"";
}

std::string box_line(const DiagramBox& box) {
  const std::string label =
      fmt::format("{}{}\n{}, {}\n{}", box.id, box.high ? " (high)" : "", box.type, box.release, box.times);
  return fmt::format("    {} [label={}{}];\n", dot_string(box.id), dot_string(label), box.high ? ", penwidth=2" : "");
}

std::string edge_line(const Diagram& diagram, const DiagramEdge& edge) {
  const DiagramInput& input = diagram.input_of(edge);
  const std::string &output = diagram.boxes[edge.from_box].outputs[edge.output].name, &type = diagram.type_of(edge);
  std::string label = output == type ? output : fmt::format("{} ({})", output, type);
  if (const std::string latch = input.latch_text(); !latch.empty()) label += "\n" + latch;
  return fmt::format("  {} -> {} [label={}{}];\n", dot_string(diagram.boxes[edge.from_box].id),
                     dot_string(diagram.boxes[edge.to_box].id), dot_string(label),
                     input.releases ? ", penwidth=2" : "");
}

}  // namespace

std::string graph_dot(const Diagram& diagram) {
  std::string text = fmt::format(
      "digraph {} {{\n  rankdir=LR;\n  label={};\n  fontname=\"Helvetica\";\n"
      "  node [shape=box, style=rounded, fontname=\"Helvetica\", fontsize=11];\n"
      "  edge [fontname=\"Helvetica\", fontsize=9];\n",
      dot_string(diagram.name), dot_string(diagram.name + "\n" + diagram.subtitle));
  for (size_t room = 0; room < diagram.rooms.size(); ++room) {
    text += fmt::format("  subgraph cluster_{} {{\n    label={};\n", room, dot_string(diagram.rooms[room]));
    for (const DiagramBox& box : diagram.boxes)
      if (box.room == room) text += box_line(box);
    text += "  }\n";
  }
  for (const DiagramEdge& edge : diagram.edges) text += edge_line(diagram, edge);
  for (const DiagramChain& chain : diagram.chains)
    text += fmt::format("  // chain {}: {} -> {}, age at most {}\n", chain.name, chain.from, chain.to,
                        time_text(chain.max_age_ns));
  return text + "}\n";
}

}  // namespace takt::view
