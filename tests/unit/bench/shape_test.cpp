// SPDX-License-Identifier: Apache-2.0
#include "bench/peers/shape.hpp"

#include <doctest/doctest.h>

#include <algorithm>

using namespace takt::bench;

namespace {

/// Every way from `node` to the sink, walked one by one: the longest, and how many there are.
struct Walk {
  size_t longest = 0, ways = 0;
};
Walk walk(const GraphShape& shape, size_t node) {
  if (node == shape.sink()) return {0, 1};
  Walk all;
  for (const GraphEdge& edge : shape.leaving(node)) {
    const Walk rest = walk(shape, edge.to);
    all.longest = std::max(all.longest, rest.longest + 1);
    all.ways += rest.ways;
  }
  return all;
}

}  // namespace

TEST_CASE("chain10: ten nodes, seven hops, two side branches that join at the sink") {
  const GraphShape shape = chain10();
  CHECK(shape.nodes == 10);
  CHECK(shape.longest_path() == 7);
  CHECK(walk(shape, 0).longest == 7);
  CHECK(walk(shape, 0).ways == 3);
  CHECK(shape.sides(shape.sink()).size() == 2);
}

TEST_CASE("one_hop: a source and a sink") {
  CHECK(one_hop().nodes == 2);
  CHECK(one_hop().longest_path() == 1);
  CHECK(one_hop().trigger(1) == 0);
}

TEST_CASE("in every shape edges go up, each node but the source has one trigger, and each leads to the sink") {
  for (const GraphShape& shape : {chain10(), one_hop()}) {
    CHECK_FALSE(shape.trigger(0));
    for (const GraphEdge& edge : shape.edges) CHECK(edge.from < edge.to);
    for (size_t node = 1; node < shape.nodes; ++node) {
      CHECK(std::count_if(shape.edges.begin(), shape.edges.end(),
                          [&](const GraphEdge& edge) { return edge.to == node && edge.trigger; }) == 1);
    }
    for (size_t node = 0; node < shape.nodes; ++node) CHECK(walk(shape, node).ways > 0);
  }
}

TEST_CASE(
    "a side branch runs before the trigger chain goes on: its message is there when the sink runs on one worker") {
  // Lanes run their members in the order of their numbers.
  const GraphShape shape = chain10();
  for (size_t side : shape.sides(shape.sink())) CHECK(side < *shape.trigger(shape.sink()));
}
