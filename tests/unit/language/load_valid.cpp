// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "fixture.hpp"

using namespace takt;
using namespace takt::test;
using namespace takt::graph;

TEST_CASE("A valid graph becomes plain data") {
  const Files files;
  const Loaded loaded = files.load();
  INFO(all(loaded));
  REQUIRE(loaded.graph);
  CHECK(loaded.problems.empty());
  const GraphSpec& graph = *loaded.graph;
  CHECK(graph.name == "tiny");
  CHECK(graph.profile == "sim");
  CHECK(graph.mode == "full");
  CHECK(graph.isolation == "none");
  CHECK(graph.directory == files.folder());
  REQUIRE(graph.devices.size() == 2);
  CHECK(graph.devices[0].id == "camera");
  CHECK(graph.devices[0].driver == "sim");
  CHECK(graph.devices[0].rate == Rate{15, 1});
  CHECK(graph.devices[0].settings["mount"]["x"].get<double>() == 0.3);
  CHECK(graph.devices[0].settings["mount"]["yaw"].get<double>() == doctest::Approx(1.5707963267948966).epsilon(1e-15));
  CHECK(graph.devices[0].settings["rig"] == (files.folder() / "rigs/a.yaml").string());
  CHECK(graph.devices[0].settings["world"] == (files.folder() / "lab.xml").string());
  REQUIRE(graph.devices[1].edges.size() == 1);
  CHECK(graph.devices[1].edges[0].from == PortName{"planner", "velocity"});
  REQUIRE(graph.nodes.size() == 3);
  CHECK(graph.nodes[0].id == "stereo");
  CHECK(graph.nodes[0].subsystem == "depth");
  CHECK(std::get<int64_t>(graph.nodes[0].params.at("disparities").value) == 150);
  CHECK(std::get<double>(graph.nodes[0].params.at("max_range").value) == 20.0);
  CHECK(graph.nodes[0].params.at("max_range").position.line == 14);
  const NodeSpec& motion = graph.nodes[1];
  REQUIRE(motion.edges.size() == 2);
  CHECK(motion.edges[0].input == "disparity");
  CHECK(motion.edges[0].depth == 3);
  CHECK(motion.edges[0].max_age_ns == 150'000'000);
  CHECK(motion.edges[1].depth == 1);
  CHECK(!motion.edges[1].max_age_ns);
  REQUIRE(motion.joins.size() == 1);
  CHECK(motion.joins[0] == std::vector<std::string>{"pair", "disparity"});
  REQUIRE(graph.chains.size() == 1);
  CHECK(graph.chains[0].max_age_ns == 700'000'000);
  REQUIRE(graph.subsystems.size() == 2);
  CHECK(graph.subsystems[0].exports == std::vector<PortName>{{"ego_motion", "motion"}});
}

TEST_CASE("A valid schedule keeps exact rates and times") {
  const Files files;
  const Loaded loaded = files.load();
  REQUIRE(loaded.graph);
  const ScheduleSpec& schedule = loaded.graph->schedule;
  CHECK(schedule.name == "slow");
  CHECK(schedule.policy == Policy::fixed);
  CHECK(schedule.cores == std::vector<int>{0, 1});
  const ScheduleEntry& stereo = schedule.entries.at("stereo");
  CHECK(stereo.rate == Rate{15, 1});
  CHECK(stereo.deadline_ns == 66'666'667);
  CHECK(stereo.offset_ns == 16'000'000);
  CHECK(stereo.budget_ns == 12'000'000);
  CHECK(stereo.criticality == Criticality::high);
  CHECK(stereo.on_overrun == OnOverrun::degrade);
  CHECK(stereo.on_miss == OnMiss::reuse_last);
  const ScheduleEntry& motion = schedule.entries.at("ego_motion");
  CHECK(motion.on == PortName{"stereo", "disparity"});
  CHECK(motion.every == 2);
  CHECK(motion.min_interval_ns == 100'000'000);
  CHECK(motion.on_miss == OnMiss::skip);
  CHECK(motion.publish == PublishAt::let);
  CHECK(schedule.entries.at("planner").rate == Rate{1, 3});
}

TEST_CASE("A device without an entry in the schedule runs at its own rate") {
  const Files files(kGraph, with(kSchedule, "  base: {rate: 10}\n", ""));
  const Loaded loaded = files.load();
  INFO(all(loaded));
  REQUIRE(loaded.graph);
  CHECK(loaded.graph->schedule.entries.at("base").rate == Rate{10, 1});
}

TEST_CASE("A profile chooses drivers and their settings") {
  const Files files;
  LoadOptions options;
  options.profile = "robot";
  const Loaded loaded = files.load(options);
  INFO(all(loaded));
  REQUIRE(loaded.graph);
  CHECK(loaded.graph->devices[0].driver == "v4l2");
  CHECK(loaded.graph->devices[0].settings["path"] == "/dev/video0");
  CHECK(loaded.graph->devices[0].settings["buffers"] == 4);
}

TEST_CASE("A profile may set parameters of nodes; --set has the last word") {
  const Files files(
      with(kGraph, "robot: {camera:", "robot: {set: {stereo.disparities: 32, stereo.max_range: 4m}, camera:"));
  LoadOptions options;
  const Loaded other = files.load(options);
  INFO(all(other));
  REQUIRE(other.graph);
  CHECK(std::get<double>(other.graph->nodes[0].params.at("max_range").value) != 4.0);
  options.profile = "robot";
  options.set = {"stereo.disparities=48"};
  const Loaded loaded = files.load(options);
  INFO(all(loaded));
  REQUIRE(loaded.graph);
  const auto& params = loaded.graph->nodes[0].params;
  CHECK(std::get<int64_t>(params.at("disparities").value) == 48);
  CHECK(std::get<double>(params.at("max_range").value) == 4.0);
}

TEST_CASE("Options change what the files say") {
  const Files files;
  files.write("other.yaml", with(kSchedule, "name: slow", "name: other"));
  LoadOptions options;
  options.schedule = files.folder() / "other.yaml";
  options.policy = "cooperative";
  options.set = {"stereo.disparities=64", "stereo.max_range=150cm", "stereo.cost=census", "camera.mount.x=1m"};
  const Loaded loaded = files.load(options);
  INFO(all(loaded));
  REQUIRE(loaded.graph);
  CHECK(loaded.graph->schedule.name == "other");
  CHECK(loaded.graph->schedule.policy == Policy::cooperative);
  CHECK(loaded.graph->mode == "full");
  const auto& params = loaded.graph->nodes[0].params;
  CHECK(std::get<int64_t>(params.at("disparities").value) == 64);
  CHECK(params.at("disparities").position.file == "--set");
  CHECK(std::get<double>(params.at("max_range").value) == 1.5);
  CHECK(std::get<std::string>(params.at("cost").value) == "census");
  CHECK(loaded.graph->devices[0].settings["mount"]["x"].get<double>() == 1.0);
}

TEST_CASE("A mode leaves out the nodes and devices it names") {
  LoadOptions options;
  options.mode = "blind";
  const Loaded loaded = Files().load(options);
  INFO(all(loaded));
  REQUIRE(loaded.graph);
  CHECK(loaded.graph->mode == "blind");
  CHECK(loaded.graph->nodes.empty());
  REQUIRE(loaded.graph->devices.size() == 1);
  CHECK(loaded.graph->devices[0].id == "camera");
  CHECK(loaded.graph->schedule.entries.size() == 1);
}

TEST_CASE("safe_stop and a bound on memory are taken as they stand") {
  const Loaded loaded =
      Files(kGraph, with(kSchedule, "on_overrun: degrade", "memory: 64MB, on_overrun: safe_stop")).load();
  INFO(all(loaded));
  REQUIRE(loaded.graph);
  CHECK(loaded.graph->adjusted.empty());
  CHECK(loaded.graph->schedule.entries.at("stereo").on_overrun == OnOverrun::safe_stop);
  CHECK(loaded.graph->schedule.entries.at("stereo").memory_bytes == 64'000'000);
  CHECK(loaded.graph->schedule.entries.at("ego_motion").memory_bytes == kDefaultMemory);
}

TEST_CASE("A node may name its core, which only the policy fixed gives it") {
  const std::string named = with(kSchedule, "rate: 1/3", "rate: 1/3, core: 1");
  const Loaded fixed = Files(kGraph, named).load();
  INFO(all(fixed));
  REQUIRE(fixed.graph);
  CHECK(fixed.graph->adjusted.empty());
  CHECK(fixed.graph->schedule.entries.at("planner").core == 1);
  CHECK(fixed.graph->schedule.entries.at("base").core == -1);
  const Loaded cooperative = Files(kGraph, with(named, "policy: fixed", "policy: cooperative")).load();
  REQUIRE(cooperative.graph);
  REQUIRE(cooperative.graph->adjusted.size() == 1);
  CHECK(cooperative.graph->adjusted[0].find("core 1 of planner -> none") == 0);
}

TEST_CASE("A node with levels degrades; for one without the word is adjusted") {
  const Loaded with_levels = Files().load();
  REQUIRE(with_levels.graph);
  CHECK(with_levels.graph->adjusted.empty());
  const Loaded loaded = Files(kGraph, with(kSchedule, "ego_motion: {", "ego_motion: {on_overrun: degrade, ")).load();
  INFO(all(loaded));
  REQUIRE(loaded.graph);
  REQUIRE(loaded.graph->adjusted.size() == 1);
  CHECK(loaded.graph->adjusted[0].find("on_overrun of ego_motion: degrade -> continue: it has one quality level") == 0);
}

TEST_CASE("A cycle of sampled edges is no error") {
  const Loaded loaded =
      Files(with(kGraph, "in: {pair: stereo.rectified,", "in: {guess: ego_motion.motion, pair: stereo.rectified,"))
          .load();
  INFO(all(loaded));
  CHECK(loaded.graph.has_value());
}

TEST_CASE("TAKT_DATA is expanded, falls back to a path relative to the file, or is asked for") {
  const char* before = std::getenv("TAKT_DATA");
  const std::string saved = before == nullptr ? "" : before;
  ::setenv("TAKT_DATA", "/some/recordings", 1);
  const std::string plain = with(kGraph, "max_range: 20m", "table: \"${TAKT_DATA}/t.bin\"");
  {
    const Loaded loaded = Files(plain).load();
    INFO(all(loaded));
    REQUIRE(loaded.graph);
    CHECK(std::get<std::string>(loaded.graph->nodes[0].params.at("table").value) == "/some/recordings/t.bin");
  }
  ::unsetenv("TAKT_DATA");
  expect(Files(plain).load(), "graph.yaml", 14, 87, {"TAKT_DATA", "not set", "export TAKT_DATA"});
  {
    const Files files(with(kGraph, "max_range: 20m", "table: \"${TAKT_DATA:-../data}/t.bin\""));
    const Loaded loaded = files.load();
    REQUIRE(loaded.graph);
    CHECK(std::get<std::string>(loaded.graph->nodes[0].params.at("table").value) ==
          (files.folder().parent_path() / "data/t.bin").string());
  }
  expect(Files(with(kGraph, "max_range: 20m", "table: \"${HOME}/t.bin\"")).load(), "graph.yaml", 14, 87,
         {"${HOME}", "${TAKT_DATA}"});
  if (before != nullptr) ::setenv("TAKT_DATA", saved.c_str(), 1);
}

TEST_CASE("Modes come in the order of the file, with the devices that they can do without") {
  const Loaded loaded = Files(with(kGraph, "blind: {without: [stereo, ego_motion, planner, base]}",
                                   "still: {without: [stereo, ego_motion, planner, base], lost: [base]}\n"
                                   "  blind: {without: [stereo, ego_motion, planner, base], lost: [camera, base]}\n"
                                   "  safe_stop: {lost: [camera]}"))
                            .load();
  INFO(all(loaded));
  REQUIRE(loaded.graph);
  const auto& modes = loaded.graph->modes;
  REQUIRE(modes.size() == 3);
  CHECK(modes[0].name == "still");
  CHECK(modes[0].pauses() == std::vector<std::string>{"stereo", "ego_motion", "planner"});
  CHECK(modes[1].lost == std::vector<std::string>{"camera", "base"});
  CHECK(modes[1].defined);
  CHECK(modes[2].name == "safe_stop");
  CHECK_FALSE(modes[2].defined);
}

TEST_CASE("A graph in a mode lacks what the mode leaves out, and the edges from there") {
  LoadOptions options;
  options.mode = "undriven";
  const Loaded loaded =
      Files(with(kGraph, "blind: {without: [stereo, ego_motion, planner, base]}", "undriven: {without: [planner]}"))
          .load(options);
  INFO(all(loaded));
  REQUIRE(loaded.graph);
  CHECK(loaded.graph->nodes.size() == 2);
  REQUIRE(loaded.graph->devices.size() == 2);
  CHECK(loaded.graph->devices[1].id == "base");
  CHECK(loaded.graph->devices[1].edges.empty());  // its velocity came from the planner
}

TEST_CASE("A safe_stop of the graph's own keeps every device that could be lost, whichever mode names it") {
  const Loaded loaded = Files(with(kGraph, "blind: {without: [stereo, ego_motion, planner, base]}",
                                   "blind: {without: [stereo, ego_motion, planner], lost: [camera]}\n"
                                   "  safe_stop: {without: [camera, stereo, ego_motion, planner]}"))
                            .load();
  INFO(all(loaded));
  REQUIRE(loaded.graph);
  REQUIRE(loaded.graph->modes.size() == 2);
  CHECK(loaded.graph->modes[1].pauses() == std::vector<std::string>{"stereo", "ego_motion", "planner"});
}
