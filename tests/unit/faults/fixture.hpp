// SPDX-License-Identifier: Apache-2.0
// A graph of a camera, a base and two subsystems as the scenarios see it, and scenario files in a folder of their own.
#pragma once
#include <doctest/doctest.h>

#include "graph/faults/scenario.hpp"
#include "rt/msg/disparity.hpp"
#include "rt/msg/image.hpp"
#include "rt/msg/motion.hpp"
#include "tests/nanoseconds.hpp"
#include "tests/temporary_folder.hpp"

namespace takt::test {

inline graph::GraphSpec small_graph() {
  graph::GraphSpec graph;
  graph.name = "tiny";
  graph.devices = {{"camera", "stereo_camera", "sim", {}, {}, {}, {}}};
  graph.nodes.resize(2);
  graph.nodes[0].id = "stereo";
  graph.nodes[0].subsystem = "depth";
  graph.nodes[1].id = "planner";
  graph.nodes[1].subsystem = "plan";
  graph.subsystems = {{"depth", {}, {}}, {"plan", {}, {}}};
  graph.chains = {{"reaction", {"camera", "pair"}, {"planner", "motion"}, 700'000'000, {}}};
  graph.modes = {{"blind", {"stereo"}, {}}};
  return graph;
}

inline Plan small_plan() {
  Plan plan;
  const auto add = [&](const char* node, const char* port, const MessageType& type, const Capacity& capacity) {
    TaskPlan task;
    task.name = node;
    task.rate = Rate{10, 1};
    task.device = std::string(node) == "camera";
    task.budget_ns = 1'000'000;
    task.deadline_ns = 100'000'000;
    task.ports = {plan.ports.size()};
    plan.tasks.push_back(task);
    plan.ports.push_back({node, port, &type, capacity, 4, 1, 1});
  };
  add("camera", "pair", MessageType::of<StereoPair>(), {.width = 8, .height = 4});
  add("stereo", "disparity", MessageType::of<DisparityMap>(), {.width = 8, .height = 4});
  add("planner", "motion", MessageType::of<Motion>(), {});
  plan.tasks[2].edges.push_back({.port = 1});
  return plan;
}

inline graph::LoadedScenario load(const std::string& text, const graph::RunKind& run = {true, false, true}) {
  const TemporaryFolder folder;
  folder.write("faults.yaml", text);
  return graph::load_scenario(folder.path / "faults.yaml", small_graph(), small_plan(), run);
}

/// A scenario with that one fault and those expectations.
inline std::string scenario_text(const std::string& fault, const std::string& expect = "{}") {
  return "takt: 1\nname: test\nfaults:\n  - " + fault + "\nexpect: " + expect + "\n";
}

inline std::string all(const graph::LoadedScenario& loaded) {
  std::string text;
  for (const auto& problem : loaded.problems) text += to_string(problem) + "\n";
  return text;
}

inline graph::Scenario sound(const std::string& text, const graph::RunKind& run = {true, false, true}) {
  auto loaded = load(text, run);
  INFO(all(loaded));
  REQUIRE(loaded.scenario);
  return std::move(*loaded.scenario);
}

}  // namespace takt::test
