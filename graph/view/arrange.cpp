// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "graph/view/layout_steps.hpp"

namespace takt::view {
namespace {

constexpr int kRounds = 12;           // far more than any graph seen needs; each round must improve to go on
constexpr double kCrossingCost = 80;  // px of edge length that one crossing is worth
constexpr double kHeightCost = 1;     // px of edge length that one px of height of the picture is worth
constexpr double kPlainChannel = 90;

Spacing plain_spacing(const Diagram& diagram, int columns) {
  const std::vector<double> none(diagram.rooms.size(), 0);
  return {std::vector<double>(diagram.boxes.size(), 0), none, none,
          std::vector<double>(static_cast<size_t>(columns), kPlainChannel)};
}

/// Side of c on which the line a-b passes it: the sign of a cross product.
double side(Point a, Point b, Point c) { return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x); }

bool cross(Point a, Point b, Point c, Point d) {
  return side(a, b, c) * side(a, b, d) < 0 && side(c, d, a) * side(c, d, b) < 0;
}

double cost_of(const Diagram& diagram, const Arrangement& arrangement) {
  const Placement placement = place(diagram, arrangement, plain_spacing(diagram, arrangement.columns));
  double cost = 0;
  for (const Rect& room : placement.rooms) cost = std::max(cost, kHeightCost * room.bottom());
  for (size_t i = 0; i < diagram.edges.size(); ++i) {
    const Point a = start_of(placement, diagram.edges[i]), b = end_of(placement, diagram.edges[i]);
    cost += std::abs(a.y - b.y);
    for (size_t k = 0; k < i; ++k) {
      const Point c = start_of(placement, diagram.edges[k]), d = end_of(placement, diagram.edges[k]);
      if (cross(a, b, c, d)) cost += kCrossingCost;
    }
  }
  return cost;
}

/// Exchanges two in `order` wherever that makes the picture better.
bool improve(std::vector<size_t>& order, const Diagram& diagram, const Arrangement& arrangement, double& best) {
  bool better = false;
  for (size_t i = 0; i < order.size(); ++i) {
    for (size_t k = i + 1; k < order.size(); ++k) {
      std::swap(order[i], order[k]);
      const double cost = cost_of(diagram, arrangement);
      if (cost < best - 1e-6) best = cost, better = true;
      else std::swap(order[i], order[k]);
    }
  }
  return better;
}

Arrangement in_graph_order(const Diagram& diagram) {
  Arrangement result;
  result.column = assign_columns(diagram);
  for (const int column : result.column) result.columns = std::max(result.columns, column + 1);
  result.cells.assign(diagram.rooms.size(), std::vector<std::vector<size_t>>(static_cast<size_t>(result.columns)));
  for (size_t box = 0; box < diagram.boxes.size(); ++box)
    result.cells[diagram.boxes[box].room][static_cast<size_t>(result.column[box])].push_back(box);
  for (size_t room = Diagram::kDeviceRoom + 1; room < diagram.rooms.size(); ++room) {
    const auto& columns = result.cells[room];
    if (std::any_of(columns.begin(), columns.end(), [](const auto& cell) { return !cell.empty(); }))
      result.room_order.push_back(room);
  }
  return result;
}

}  // namespace

Arrangement arrange(const Diagram& diagram) {
  Arrangement arrangement = in_graph_order(diagram);
  double best = cost_of(diagram, arrangement);
  for (int round = 0; round < kRounds; ++round) {
    bool better = improve(arrangement.room_order, diagram, arrangement, best);
    for (auto& room : arrangement.cells)
      for (auto& cell : room) better = improve(cell, diagram, arrangement, best) || better;
    if (!better) break;
  }
  return arrangement;
}

}  // namespace takt::view
