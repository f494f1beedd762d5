// SPDX-License-Identifier: Apache-2.0
// Diagrams for the tests of pictures: the project's own graphs, and made-up ones of any size.
#pragma once
#include <doctest/doctest.h>

#include <filesystem>
#include <random>
#include <string>

#include "graph/ace/ace_registry.hpp"
#include "graph/compose/composition.hpp"
#include "graph/view/diagram.hpp"
#include "tests/graph_folder.hpp"

namespace takt::test {

inline graph::GraphSpec load_ace() {
  auto loaded = graph::load(takt::test::graph_folder() / "ace.yaml", {}, ace_registry());
  for (const auto& problem : loaded.problems) MESSAGE(graph::to_string(problem));
  REQUIRE(loaded.graph);
  return *loaded.graph;
}

inline view::Diagram ace_diagram() { return view::make_diagram(load_ace(), ace_registry()); }

/// `devices` devices and `nodes` nodes in rooms; edges mostly forward, some against the order, some to devices.
inline view::Diagram random_diagram(unsigned seed, size_t devices, size_t nodes, size_t edges) {
  std::mt19937 random(seed);
  const auto below = [&](size_t n) { return std::uniform_int_distribution<size_t>(0, n - 1)(random); };
  view::Diagram diagram;
  diagram.name = "random";
  diagram.rooms = {"devices", "depth", "map", "view", "a subsystem with a long name"};
  for (size_t b = 0; b < devices + nodes; ++b) {
    view::DiagramBox box;
    box.device = b < devices;
    box.id = (box.device ? "device_" : "node_") + std::to_string(b);
    box.type = "some_type";
    box.release = "15 Hz";
    box.times = "budget 12 ms, deadline 25 ms";
    box.high = below(3) == 0;
    box.room = box.device ? 0 : 1 + below(diagram.rooms.size() - 1);
    for (size_t o = 0; o < 1 + below(3); ++o) box.outputs.push_back({"out_" + std::to_string(o), "motion", true});
    diagram.boxes.push_back(std::move(box));
  }
  for (size_t e = 0; e < edges; ++e) {
    size_t from = below(devices + nodes), to = below(devices + nodes);
    if (from > to && below(4) != 0) std::swap(from, to);
    auto& inputs = diagram.boxes[to].inputs;
    diagram.edges.push_back({from, below(diagram.boxes[from].outputs.size()), to, inputs.size()});
    inputs.push_back({"in_" + std::to_string(inputs.size()), 1 + static_cast<int>(below(4)), std::nullopt, -1, false});
  }
  return diagram;
}

inline size_t count(const std::string& text, const std::string& part) {
  size_t n = 0;
  for (size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
  return n;
}

}  // namespace takt::test
