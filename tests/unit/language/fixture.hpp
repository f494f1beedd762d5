// SPDX-License-Identifier: Apache-2.0
// A small world for the loader's tests: fake node types, a fake device catalogue, files in a folder of their own.
#pragma once
#include <doctest/doctest.h>

#include <algorithm>
#include <filesystem>
#include <string>

#include "graph/language/catalogue.hpp"
#include "rt/msg/disparity.hpp"
#include "rt/msg/image.hpp"
#include "rt/msg/motion.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/msg/velocity_command.hpp"
#include "tests/temporary_folder.hpp"

namespace takt::test {

struct FakeStereo : Node {
  Input<StereoPair> pair{this, "pair", "raw images"};
  Output<StereoPair> rectified{this, "rectified", "rectified images"};
  Output<DisparityMap> disparity{this, "disparity", "disparities"};
  Levels levels{this, {{"full", 1.0}, {"half", 0.3}}};
  Param<int> disparities{this, "disparities", 64, {1, 512}, "px", "number of disparities"};
  Param<double> max_range{this, "max_range", 10.0, {0.5, 50.0}, "m", "farthest point"};
  Param<double> window{this, "window", 0.1, {0.0, 1.0}, "s", "time window"};
  Param<double> gain{this, "gain", 1.0, "1", "a pure number"};
  Param<bool> fill{this, "fill", true, "", "fill holes"};
  Param<std::string> table{this, "table", "none", "", "a file"};
  Choice cost{this, "cost", "sad", {"sad", "census"}, "matching cost"};
  void setup(Setup&) override {}
  void run(Job&) override {}
};

struct FakeMotion : Node {
  Input<StereoPair> pair{this, "pair", "rectified images"};
  Input<DisparityMap> disparity{this, "disparity", "disparities"};
  Input<Motion> guess{this, "guess", "a first guess", Need::optional};
  Output<Motion> motion{this, "motion", "motion"};
  void setup(Setup&) override {}
  void run(Job&) override {}
};

struct FakePlanner : Node {
  Input<Motion> motion{this, "motion", "motion"};
  Output<VelocityCommand> velocity{this, "velocity", "wanted speed"};
  Output<Motion> guess{this, "guess", "what to expect"};
  void setup(Setup&) override {}
  void run(Job&) override {}
};

inline NodeTypes fake_types() {
  NodeTypes types;
  types.add<FakeStereo>("stereo", Layer::perception, "disparities of a pair");
  types.add<FakeMotion>("ego_motion", Layer::perception, "motion of the camera");
  types.add<FakePlanner>("planner", Layer::processing, "where to go");
  return types;
}

inline graph::DeviceSetting setting(std::string name, graph::DeviceSetting::Kind kind, std::string unit = "") {
  graph::DeviceSetting result;
  result.name = std::move(name);
  result.kind = kind;
  result.unit = std::move(unit);
  return result;
}

inline graph::DeviceCatalogue fake_devices() {
  using Kind = graph::DeviceSetting::Kind;
  graph::DeviceKindEntry camera;
  camera.name = "stereo_camera";
  camera.ports = {{"pair", &MessageType::of<StereoPair>(), false, "images"}};
  camera.settings = {setting("rig", Kind::path), setting("mount.x", Kind::number, "m"),
                     setting("mount.yaw", Kind::number, "rad")};
  auto world = setting("world", Kind::path);
  world.required = true;
  auto seed = setting("buffers", Kind::integer);
  seed.low = 1;
  seed.high = 8;
  camera.drivers = {{"sim", "simulated", {world}}, {"v4l2", "real", {setting("path", Kind::path), seed}}};
  graph::DeviceKindEntry base;
  base.name = "mobile_base";
  base.ports = {{"velocity", &MessageType::of<VelocityCommand>(), true, "wanted speed"},
                {"odometry", &MessageType::of<Odometry>(), false, "where it thinks it is"}};
  base.drivers = {{"sim", "simulated", {world}}};
  graph::DeviceCatalogue catalogue;
  catalogue.kinds["stereo_camera"] = camera;
  catalogue.kinds["mobile_base"] = base;
  return catalogue;
}

inline const std::string kGraph = R"(takt: 1
name: tiny
schedule: schedule.yaml
default_profile: sim
devices:
  camera: {kind: stereo_camera, rig: rigs/a.yaml, rate: 15, mount: {x: 30cm, yaw: 90deg}}
  base: {kind: mobile_base, rate: 10, in: {velocity: planner.velocity}}
profiles:
  sim: {default: {driver: sim, world: lab.xml}}
  robot: {camera: {driver: v4l2, path: /dev/video0, buffers: 4}, base: {driver: sim, world: lab.xml}}
subsystems:
  depth:
    exports: [ego_motion.motion]
    stereo: {type: stereo, in: {pair: camera.pair}, params: {disparities: 150, max_range: 20m}}
    ego_motion:
      type: ego_motion
      in: {pair: stereo.rectified, disparity: {from: stereo.disparity, depth: 3, max_age: 150ms}}
      join: [pair, disparity]
  plan:
    exports: [planner.velocity]
    planner: {type: planner, in: {motion: ego_motion.motion}}
chains:
  reaction: {from: camera.pair, to: planner.velocity, max_age: 700ms}
modes:
  blind: {without: [stereo, ego_motion, planner, base]}
)";

inline const std::string kSchedule = R"(takt: 1
name: slow
policy: fixed
cores: [0, 1]
nodes:
  camera: {rate: 15, budget: 2ms, deadline: 10ms}
  base: {rate: 10}
  stereo: {rate: 15, offset: 16ms, budget: 12ms, deadline: 1/15 s, criticality: high, on_overrun: degrade, on_miss: reuse_last}
  ego_motion: {on: stereo.disparity, every: 2, min_interval: 100ms, budget: 5ms, on_miss: skip, publish: let}
  planner: {rate: 1/3}
)";

/// A folder with graph.yaml and schedule.yaml that goes with the object.
class Files {
 public:
  Files(const std::string& graph = kGraph, const std::string& schedule = kSchedule) {
    write("graph.yaml", graph);
    write("schedule.yaml", schedule);
  }
  void write(const std::string& name, const std::string& text) const { folder_.write(name, text); }
  std::filesystem::path folder() const { return folder_.path; }
  graph::Loaded load(const graph::LoadOptions& options = {}) const {
    static const NodeTypes types = fake_types();
    static const graph::DeviceCatalogue devices = fake_devices();
    return graph::load(folder() / "graph.yaml", options, types, devices);
  }

 private:
  TemporaryFolder folder_;
};

/// `text` with its only occurrence of `from` replaced.
inline std::string with(const std::string& text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  REQUIRE_MESSAGE(at != std::string::npos, from);
  REQUIRE_MESSAGE(text.find(from, at + 1) == std::string::npos, from);
  return text.substr(0, at) + to + text.substr(at + from.size());
}

inline std::string all(const graph::Loaded& loaded) {
  std::string text;
  for (const auto& problem : loaded.problems) text += to_string(problem) + "\n";
  return text;
}

/// Exactly one problem, at that place of that file, whose text holds all the words.
inline void expect(const graph::Loaded& loaded, const std::string& file, int line, int column,
                   const std::vector<std::string>& words) {
  INFO(all(loaded));
  CHECK(!loaded.graph);
  REQUIRE(loaded.problems.size() == 1);
  const auto& problem = loaded.problems[0];
  CHECK(std::filesystem::path(problem.position.file).filename().string() == file);
  CHECK(problem.position.line == line);
  CHECK(problem.position.column == column);
  for (const auto& word : words) {
    CAPTURE(word);
    CHECK(problem.text.find(word) != std::string::npos);
  }
}

/// The same, at the first `at` in that file's text from `begin` on.
inline void expect_at(const graph::Loaded& loaded, const std::string& file, const std::string& text,
                      const std::string& at, const std::vector<std::string>& words, size_t begin = 0) {
  const size_t where = text.find(at, begin);
  REQUIRE_MESSAGE(where != std::string::npos, at);
  const size_t line_start = text.rfind('\n', where) + 1;
  const auto line = 1 + static_cast<int>(std::count(text.begin(), text.begin() + static_cast<long>(where), '\n'));
  expect(loaded, file, line, static_cast<int>(where - line_start) + 1, words);
}

/// The same for kGraph (or kSchedule) with one place changed, to which `at` refers.
inline void expect_graph(const std::string& from, const std::string& to, const std::string& at,
                         const std::vector<std::string>& words, const graph::LoadOptions& options = {}) {
  const std::string text = with(kGraph, from, to);
  expect_at(Files(text).load(options), "graph.yaml", text, at, words);
}
inline void expect_schedule(const std::string& from, const std::string& to, const std::string& at,
                            const std::vector<std::string>& words, const graph::LoadOptions& options = {}) {
  const std::string text = with(kSchedule, from, to);
  expect_at(Files(kGraph, text).load(options), "schedule.yaml", text, at, words);
}

}  // namespace takt::test
