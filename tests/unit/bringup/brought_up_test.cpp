// SPDX-License-Identifier: Apache-2.0
// What was tried counts as long as nothing of it changes, and decides whether a graph may drive.
#include "graph/bringup/brought_up.hpp"

#include <doctest/doctest.h>

#include "graph/ace/ace_registry.hpp"
#include "graph/bringup/altered.hpp"
#include "tests/graph_folder.hpp"
#include "tests/temporary_folder.hpp"

using namespace takt;
using namespace takt::bringup;

namespace {

graph::GraphSpec main_graph(const std::string& profile, const std::vector<std::string>& set = {}) {
  static const Registry registry = ace_registry();
  graph::LoadOptions options;
  options.profile = profile;
  options.set = set;
  const graph::Loaded loaded = graph::load(test::graph_folder() / "ace.yaml", options, registry);
  REQUIRE(loaded.graph);
  return *loaded.graph;
}

graph::DeviceSpec& device(graph::GraphSpec& graph, const std::string& id) {
  const auto found =
      std::find_if(graph.devices.begin(), graph.devices.end(), [&](const auto& d) { return d.id == id; });
  REQUIRE(found != graph.devices.end());
  return *found;
}

/// As if all of it had been tried and was well.
BroughtUp all_of(const graph::GraphSpec& graph, const Registry& registry) {
  BroughtUp known;
  for (const graph::DeviceSpec* d : real_devices(graph, registry))
    known.devices[d->id] = {fingerprint(*d), "2026-01-01T00:00:00Z", "well", true};
  known.stop_chain = {stop_fingerprint(graph, "base"), "2026-01-01T00:10:00Z", "stood", true};
  return known;
}

}  // namespace

TEST_CASE("simulated devices need no trial; of real ones those that move the robot come last") {
  const Registry registry = ace_registry();
  CHECK(real_devices(main_graph("sim"), registry).empty());
  CHECK(lacks(main_graph("sim"), registry, {}).empty());
  const graph::GraphSpec robot = main_graph("robot");
  const auto real = real_devices(robot, registry);
  REQUIRE(real.size() >= 5);
  CHECK(base_of(real)->id == "base");
  CHECK(real[real.size() - 2]->kind == "camera_head");
  CHECK(real_devices(main_graph("doubles"), registry).empty());
  CHECK(real_devices(main_graph("doubles"), registry, true).size() == real.size());
}

TEST_CASE("every device and the stop are asked for, until all of them were tried and are well") {
  const Registry registry = ace_registry();
  const graph::GraphSpec robot = main_graph("robot");
  const auto real = real_devices(robot, registry);
  CHECK(lacks(robot, registry, {}).size() == real.size() + 1);
  const BroughtUp known = all_of(robot, registry);
  CHECK(lacks(robot, registry, known).empty());
  for (const graph::DeviceSpec* one : real) {
    BroughtUp less = known;
    less.devices.erase(one->id);
    REQUIRE(lacks(robot, registry, less).size() == 1);
    CHECK(lacks(robot, registry, less)[0] == one->id + " was never tried");
    less = known;
    less.devices[one->id].passed = false;
    CHECK(lacks(robot, registry, less)[0] == one->id + " did not pass at 2026-01-01T00:00:00Z: well");
  }
  BroughtUp less = known;
  less.stop_chain.passed = false;
  CHECK(lacks(robot, registry, less) ==
        std::vector<std::string>{"the stop of base did not pass at 2026-01-01T00:10:00Z: stood"});
}

TEST_CASE("another setting of a device, of the stop's nodes or edges asks for another trial, and nothing else does") {
  const Registry registry = ace_registry();
  const graph::GraphSpec robot = main_graph("robot");
  const BroughtUp known = all_of(robot, registry);
  graph::GraphSpec other = robot;
  device(other, "front_laser").settings["baud"] = 38400;
  CHECK(lacks(other, registry, known) ==
        std::vector<std::string>{"front_laser was tried at 2026-01-01T00:00:00Z, and has other settings now",
                                 "the stop of base was tried at 2026-01-01T00:10:00Z, and has other settings now"});
  CHECK(lacks(main_graph("robot", {"obstacle_stop.margin=0.31m"}), registry, known).size() == 1);
  CHECK(lacks(main_graph("robot", {"mapping_3d.share=0.3"}), registry, known).empty());
  other = robot;
  for (graph::EdgeSpec& edge : device(other, "base").edges)
    if (edge.input == "stop") edge.max_age_ns = 1;
  CHECK(lacks(other, registry, known).size() == 1);
  device(other, "base").edges.clear();
  CHECK(lacks(other, registry, known) ==
        std::vector<std::string>{"nothing stops base: its input `stop` is not connected"});
}

TEST_CASE("what is known is read as it was written; a file of another kind is refused with its name") {
  const test::TemporaryFolder folder;
  const auto file = brought_up_file(folder.path, "ace");
  CHECK(file == folder.path / "bringup/ace.json");
  CHECK(brought_up_file({}, "ace").empty());
  BroughtUp known;
  known.devices["front_laser"] = {"1234", "2026-01-01T00:00:00Z", "15.0 messages a second; 1.82 m", true};
  known.stop_chain = {"5678", "2026-01-01T00:10:00Z", "it did not stop", false};
  CHECK(BroughtUp::read(file)->devices.empty());
  REQUIRE(known.write(file, "ace"));
  const auto again = BroughtUp::read(file);
  REQUIRE(again);
  CHECK(again->devices == known.devices);
  CHECK(again->stop_chain == known.stop_chain);
  for (const char* text : {"", "{}", "[]", R"({"takt": 2, "devices": {}, "stop_chain": {}})",
                           R"({"takt": 1, "devices": {"a": 1}, "stop_chain": {}})"}) {
    folder.write("bringup/ace.json", text);
    const auto wrong = BroughtUp::read(file);
    REQUIRE_MESSAGE(!wrong, text);
    CHECK(wrong.error().find(file.string()) == 0);
  }
}

TEST_CASE("the graphs of trials: one device alone, and a base that only the trial drives") {
  graph::GraphSpec alone = main_graph("robot");
  leave_only(alone, "front_laser");
  REQUIRE(alone.devices.size() == 1);
  CHECK(alone.nodes.empty());
  CHECK(alone.schedule.entries.size() == 1);
  graph::GraphSpec driven = main_graph("robot");
  const size_t nodes = driven.nodes.size();
  drive_by_hand(driven, "base");
  CHECK(driven.nodes.size() == nodes + 1);
  const auto& edges = device(driven, "base").edges;
  CHECK(std::count_if(edges.begin(), edges.end(), [](const auto& e) { return e.input == "velocity"; }) == 1);
  CHECK(std::any_of(edges.begin(), edges.end(),
                    [](const auto& e) { return e.input == "velocity" && e.from.node == kDriver; }));
  CHECK(std::any_of(edges.begin(), edges.end(), [](const auto& e) { return e.input == "stop"; }));
  CHECK(driven.schedule.entries.at(kDriver).rate.has_value());
}
