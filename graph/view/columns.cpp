// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "graph/view/layout_steps.hpp"

namespace takt::view {
namespace {

/// Depth-first over the readers of each box; an edge back to a box under way closes a cycle.
class Columns {
 public:
  explicit Columns(const Diagram& diagram) : readers_(diagram.boxes.size()), state_(diagram.boxes.size()) {
    for (const DiagramEdge& edge : diagram.edges)
      if (gives_data(diagram, edge)) readers_[edge.from_box].push_back(edge.to_box);
    // Devices first: what they reach is entered the way the data go.
    for (size_t box = 0; box < diagram.boxes.size(); ++box)
      if (diagram.boxes[box].device) visit(box);
    for (size_t box = 0; box < diagram.boxes.size(); ++box) visit(box);
  }

  /// Boxes in an order in which every edge that closes no cycle goes forward.
  std::vector<size_t> order() const { return {finished_.rbegin(), finished_.rend()}; }
  const std::vector<std::vector<size_t>>& forward() const { return readers_; }

 private:
  /// Commands to devices and requests to nodes go against the data.
  static bool gives_data(const Diagram& diagram, const DiagramEdge& edge) {
    return !diagram.boxes[edge.to_box].device && !edge.control;
  }

  enum class State : uint8_t { fresh, under_way, done };

  void visit(size_t box) {
    if (state_[box] != State::fresh) return;
    state_[box] = State::under_way;
    std::erase_if(readers_[box], [&](size_t reader) {
      visit(reader);
      return state_[reader] == State::under_way;
    });
    state_[box] = State::done;
    finished_.push_back(box);
  }

  std::vector<std::vector<size_t>> readers_;
  std::vector<State> state_;
  std::vector<size_t> finished_;
};

}  // namespace

std::vector<int> assign_columns(const Diagram& diagram) {
  std::vector<int> column(diagram.boxes.size());
  for (size_t box = 0; box < column.size(); ++box) column[box] = diagram.boxes[box].device ? 0 : 1;
  const Columns columns(diagram);
  for (const size_t box : columns.order())
    for (const size_t reader : columns.forward()[box]) column[reader] = std::max(column[reader], column[box] + 1);
  return column;
}

}  // namespace takt::view
