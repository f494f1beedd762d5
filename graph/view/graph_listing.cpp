// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <sstream>

#include "graph/view/graph_pictures.hpp"

namespace takt::view {
namespace {

constexpr size_t kColumns = 80;

/// Words after `start`, broken before column 80; further lines are indented.
std::string wrapped(const std::string& start, const std::string& text, size_t indent) {
  std::string result, current = start;
  std::istringstream words(text);
  bool first = true;
  for (std::string word; words >> word; first = false) {
    const bool glued = first && (current.empty() || current.back() == ' ');
    if (!first && current.size() + 1 + word.size() > kColumns) {
      result += current + "\n";
      current = std::string(indent, ' ') + word;
    } else {
      current += (glued ? "" : " ") + word;
    }
  }
  return result + current + "\n";
}

std::string box_text(const Diagram& diagram, size_t b) {
  const DiagramBox& box = diagram.boxes[b];
  std::string text =
      wrapped(fmt::format("  {:<16} ", box.id),
              fmt::format("{}, {}, {}{}", box.type, box.release, box.times, box.high ? ", high" : ""), 19);
  for (const DiagramEdge& edge : diagram.edges) {
    if (edge.to_box != b) continue;
    const DiagramInput& input = diagram.input_of(edge);
    std::string source = fmt::format("<- {} ({})", diagram.from_text(edge), diagram.type_of(edge));
    if (const std::string latch = input.latch_text(); !latch.empty()) source += ", " + latch;
    if (input.join >= 0) source += ", joined";
    text += wrapped(fmt::format("      {:<12} ", input.name), source, 22);
  }
  return text;
}

}  // namespace

std::string graph_listing(const Diagram& diagram) {
  std::string text = wrapped("", fmt::format("{}: {}", diagram.name, diagram.subtitle), 2);
  for (size_t room = 0; room < diagram.rooms.size(); ++room) {
    std::string boxes;
    for (size_t box = 0; box < diagram.boxes.size(); ++box)
      if (diagram.boxes[box].room == room) boxes += box_text(diagram, box);
    if (!boxes.empty()) text += "\n" + diagram.rooms[room] + "\n" + boxes;
  }
  if (!diagram.chains.empty()) text += "\nchains\n";
  for (const DiagramChain& chain : diagram.chains)
    text += wrapped(fmt::format("  {:<16} ", chain.name),
                    fmt::format("{} -> {}, age at most {}", chain.from, chain.to, time_text(chain.max_age_ns)), 19);
  return text;
}

}  // namespace takt::view
