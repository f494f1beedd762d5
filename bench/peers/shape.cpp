// SPDX-License-Identifier: Apache-2.0
#include "bench/peers/shape.hpp"

#include <algorithm>

namespace takt::bench {

std::optional<size_t> GraphShape::trigger(size_t node) const {
  for (const GraphEdge& edge : edges)
    if (edge.to == node && edge.trigger) return edge.from;
  return std::nullopt;
}

std::vector<size_t> GraphShape::sides(size_t node) const {
  std::vector<size_t> producers;
  for (const GraphEdge& edge : edges)
    if (edge.to == node && !edge.trigger) producers.push_back(edge.from);
  return producers;
}

std::vector<GraphEdge> GraphShape::leaving(size_t node) const {
  std::vector<GraphEdge> out;
  for (const GraphEdge& edge : edges)
    if (edge.from == node) out.push_back(edge);
  return out;
}

size_t GraphShape::longest_path() const {
  std::vector<size_t> hops(nodes, 0);
  for (size_t node = 0; node < nodes; ++node)  // edges go up, so hops[node] is final here
    for (const GraphEdge& edge : leaving(node)) hops[edge.to] = std::max(hops[edge.to], hops[node] + 1);
  return hops[sink()];
}

GraphShape chain10() {
  return {10,
          {{0, 1},
           {1, 2},
           {2, 3},  // side branch: 3
           {2, 4},
           {4, 5},
           {5, 6},  // side branch: 6
           {5, 7},
           {7, 8},
           {8, 9},
           {3, 9, false},
           {6, 9, false}}};
}

GraphShape one_hop() { return {2, {{0, 1}}}; }

}  // namespace takt::bench
