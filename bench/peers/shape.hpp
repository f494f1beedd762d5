// SPDX-License-Identifier: Apache-2.0
// Which node feeds which. Every contestant of a graph benchmark runs the same shape.
#pragma once
#include <cstddef>
#include <optional>
#include <vector>

namespace takt::bench {

/// From producer to consumer. A node runs when its trigger edge brings a message; of its other edges it takes what is
/// there.
struct GraphEdge {
  size_t from = 0, to = 0;
  bool trigger = true;
};

/// Nodes are numbered so that every edge goes up: 0 is the source, nodes - 1 the sink.
struct GraphShape {
  size_t nodes = 0;
  std::vector<GraphEdge> edges;

  size_t sink() const { return nodes - 1; }
  /// The producer whose message makes `node` run; none for the source.
  std::optional<size_t> trigger(size_t node) const;
  /// The producers whose newest message `node` takes along.
  std::vector<size_t> sides(size_t node) const;
  /// The edges that leave `node`.
  std::vector<GraphEdge> leaving(size_t node) const;
  /// Edges on the longest way from source to sink.
  size_t longest_path() const;
};

/// Ten nodes, seven hops, two side branches that join again at the sink (drawn in bench/README.md).
GraphShape chain10();
/// A source and a sink.
GraphShape one_hop();

}  // namespace takt::bench
