// SPDX-License-Identifier: Apache-2.0
// A graph of several files: include, constants, the parameter file of a robot; each error names the file at fault.
#include <fmt/format.h>

#include "tests/unit/language/fixture.hpp"

namespace {

using namespace takt;
using namespace takt::graph;
using test::all;
using test::with;

/// kGraph in two files: the devices stand in parts/robot.yaml.
const std::string kHead = "takt: 1\nname: tiny\ninclude: [parts/robot.yaml]\nschedule: schedule.yaml\n";
const std::string kRobot =
    "takt: 1\n" + test::kGraph.substr(test::kGraph.find("default_profile"),
                                      test::kGraph.find("subsystems:") - test::kGraph.find("default_profile"));
const std::string kNodes = test::kGraph.substr(test::kGraph.find("subsystems:"));

struct Split : test::Files {
  Split(const std::string& head = kHead, const std::string& robot = kRobot, const std::string& nodes = kNodes)
      : Files(head + nodes) {
    std::filesystem::create_directories(folder() / "parts");
    write("parts/robot.yaml", robot);
  }
  Loaded with_params(const std::string& text) const {
    write("robot_a.yaml", text);
    LoadOptions options;
    options.params = folder() / "robot_a.yaml";
    return load(options);
  }
};

double number(const Loaded& loaded, const std::string& name) {
  REQUIRE_MESSAGE(loaded.graph, all(loaded));
  return std::get<double>(loaded.graph->nodes[0].params.at(name).value);
}

const std::string kConstants = "constants: {far: 20m, cells: 150, fit: census}\n";
std::string constant_nodes() {
  return with(with(kNodes, "max_range: 20m", "max_range: \"${far}\", cost: \"${fit}\""), "disparities: 150",
              "disparities: \"${cells}\"");
}

}  // namespace

TEST_CASE("a graph in two files is the graph in one, and each part has its own position") {
  const Split files;
  const Loaded loaded = files.load();
  REQUIRE_MESSAGE(loaded.graph, all(loaded));
  CHECK(loaded.graph->devices.size() == 2);
  CHECK(loaded.graph->nodes.size() == 3);
  CHECK(loaded.graph->profile == "sim");
  CHECK(loaded.graph->devices[0].position.file == (files.folder() / "parts/robot.yaml").string());
  CHECK(loaded.graph->nodes[0].position.file == (files.folder() / "graph.yaml").string());
  CHECK(loaded.graph->files ==
        std::vector{(files.folder() / "graph.yaml").string(), (files.folder() / "parts/robot.yaml").string()});
}

TEST_CASE("a relative path starts at the file it stands in") {
  const Split files;
  const Loaded loaded = files.load();
  REQUIRE_MESSAGE(loaded.graph, all(loaded));
  CHECK(loaded.graph->devices[0].settings["world"] == (files.folder() / "parts/lab.xml").string());
  const Split moved(with(kHead, "schedule: schedule.yaml\n", ""), kRobot + "schedule: ../schedule.yaml\n");
  CHECK_MESSAGE(moved.load().graph, all(moved.load()));
}

TEST_CASE("plug-ins that included files name are looked for beside these; all lists are one") {
  const Split files(kHead + "plugins: [own.so]\n", kRobot + "plugins: [robot.so, ../own.so]\n");
  REQUIRE_MESSAGE(files.load().graph, all(files.load()));
  const std::vector<PluginName> named = plugins_of(files.folder() / "graph.yaml");
  REQUIRE(named.size() == 3);
  CHECK(named[0].file == "own.so");
  CHECK(named[0].directory == files.folder());
  CHECK(named[1].file == "robot.so");
  CHECK(named[1].directory == files.folder() / "parts");
  CHECK(named[1].position.file == (files.folder() / "parts/robot.yaml").string());
  CHECK(named[2].file == "../own.so");
  const std::string wrong = kRobot + "plugins: [robot.so, [nested.so]]\n";
  test::expect_at(Split(kHead + "plugins: [own.so]\n", wrong).load(), "robot.yaml", wrong, "[nested.so]",
                  {"plugins `2` is a list", "a shared module"});
  const std::string none = kRobot + "plugins: robot.so\n";
  test::expect_at(Split(kHead + "plugins: [own.so]\n", none).load(), "robot.yaml", none, "plugins", {"plugins"});
  files.write("parts/robot.yaml", kRobot + "include: [../graph.yaml]\nplugins: [robot.so]\n");  // ends all the same
  CHECK(plugins_of(files.folder() / "graph.yaml").size() == 2);
}

TEST_CASE("an error in an included file points there") {
  const std::string wrong = with(kRobot, "driver: v4l2", "driver: v4l3");
  LoadOptions robot;
  robot.profile = "robot";
  test::expect_at(Split(kHead, wrong).load(robot), "robot.yaml", wrong, "v4l3", {"`v4l3`", "did you mean `v4l2`"});
  const std::string unknown = kRobot + "moods: {}\n";
  test::expect_at(Split(kHead, unknown).load(), "robot.yaml", unknown, "moods", {"unknown key `moods`", "modes"});
  const std::string bare = with(kRobot, "takt: 1\n", "");
  test::expect(Split(kHead, bare).load(), "robot.yaml", 1, 1, {"`takt: 1` is missing"});
  const std::string newer = with(kRobot, "takt: 1\n", "takt: 2\n");
  test::expect(Split(kHead, newer).load(), "robot.yaml", 1, 7, {"version 2", "reads version 1", "a later Takt"});
  const std::string older = with(kRobot, "takt: 1\n", "takt: 0\n");
  test::expect(Split(kHead, older).load(), "robot.yaml", 1, 7, {"takt must be 1"});
}

TEST_CASE("a missing file, one that is included twice and one that includes itself are reported where they are named") {
  test::expect(Split(with(kHead, "[parts/robot.yaml]", "[parts/robot.yaml, none.yaml]")).load(), "graph.yaml", 3, 29,
               {"none.yaml", "there is no such file"});
  test::expect(Split(with(kHead, "[parts/robot.yaml]", "[parts/robot.yaml, parts/../parts/robot.yaml]")).load(),
               "graph.yaml", 3, 29, {"included twice", "graph.yaml:3:11"});
  const std::string cycle = kRobot + "include: [../graph.yaml]\n";
  test::expect_at(Split(kHead, cycle).load(), "robot.yaml", cycle, "../graph.yaml",
                  {"includes itself", "graph.yaml:3:11"});
}

TEST_CASE("what two files define is reported with both places") {
  const std::string chains = "chains:\n  reaction: {from: camera.pair, to: planner.velocity, max_age: 1s}\n";
  const std::string robot = kRobot + chains;
  test::expect_at(Split(kHead, robot).load(), "robot.yaml", robot, "reaction",
                  {"duplicate `reaction` in `chains`", "graph.yaml:17:3"});
  const Split own(kHead + "default_profile: robot\n");  // what the including file says itself wins
  REQUIRE_MESSAGE(own.load().graph, all(own.load()));
  CHECK(own.load().graph->profile == "robot");
}

TEST_CASE("profiles of several files are one, down to their settings") {
  const Split files(kHead + "profiles:\n  robot: {camera: {mount: {x: 12cm}}}\n");
  LoadOptions robot;
  robot.profile = "robot";
  const Loaded loaded = files.load(robot);
  REQUIRE_MESSAGE(loaded.graph, all(loaded));
  CHECK(loaded.graph->devices[0].driver == "v4l2");
  CHECK(loaded.graph->devices[0].settings["mount"]["x"] == doctest::Approx(0.12));
}

TEST_CASE("constants take their type and unit where they are used, also within a text and from an included file") {
  for (const auto& [head, robot] : {std::pair(kHead + kConstants, kRobot), std::pair(kHead, kRobot + kConstants)}) {
    const Loaded loaded = Split(head, robot, constant_nodes()).load();
    CHECK(number(loaded, "max_range") == 20);
    CHECK(std::get<int64_t>(loaded.graph->nodes[0].params.at("disparities").value) == 150);
    CHECK(std::get<std::string>(loaded.graph->nodes[0].params.at("cost").value) == "census");
  }
  const std::string within = with(kNodes, "max_range: 20m", "max_range: \"${cells}cm\"");
  CHECK(number(Split(kHead + kConstants, kRobot, within).load(), "max_range") == doctest::Approx(1.5));
}

TEST_CASE("an unknown constant, or one of another, is reported with those that there are") {
  const std::string nodes = with(constant_nodes(), "${far}", "${fat}");
  const std::string text = kHead + kConstants + nodes;
  test::expect_at(Split(kHead + kConstants, kRobot, nodes).load(), "graph.yaml", text, "\"${fat}\"",
                  {"there is no constant `fat`", "did you mean `far`", "cells, far, fit"});
  const std::string nested = with(kConstants, "far: 20m", "far: \"${cells}m\"");
  const Loaded loaded = Split(kHead + nested, kRobot, kNodes).load();
  test::expect_at(loaded, "graph.yaml", kHead + nested, "\"${cells}m\"", {"constant `far` names a constant"});
}

TEST_CASE("a constant with a wrong value is reported where it stands, with the place that uses it") {
  const std::string robot = kRobot + with(kConstants, "20m", "20kg");
  const Split files(kHead, robot, constant_nodes());
  const Loaded loaded = files.load();
  test::expect_at(loaded, "robot.yaml", robot, "20kg", {"`max_range` of node `stereo`", "kg"});
  const std::string shown = to_string(loaded.problems.at(0));
  CHECK_MESSAGE(
      shown.find("constant `far`, used at " + (files.folder() / "graph.yaml").string() + ":8:") != std::string::npos,
      shown);
  const std::string type = kHead + with(kConstants, "150", "many");
  test::expect_at(Split(type, kRobot, constant_nodes()).load(), "graph.yaml", type, "many", {"`disparities`", "many"});
}

TEST_CASE("a parameter file gives constants, parameters and settings to one robot; --set wins") {
  const Split files(kHead + kConstants, kRobot, constant_nodes());
  const std::string robot =
      "takt: 1\ngraph: tiny\nconstants: {far: 15m}\nnodes:\n  stereo: {window: 20ms}\n"
      "devices:\n  camera: {mount: {x: 7cm}, rig: rigs/b.yaml}\n";
  const Loaded loaded = files.with_params(robot);
  CHECK(number(loaded, "max_range") == 15);
  CHECK(number(loaded, "window") == doctest::Approx(0.02));
  CHECK(loaded.graph->devices[0].settings["mount"]["x"] == doctest::Approx(0.07));
  CHECK(loaded.graph->devices[0].settings["rig"] == (files.folder() / "rigs/b.yaml").string());
  CHECK(loaded.graph->files.back() == (files.folder() / "robot_a.yaml").string());
  LoadOptions options;
  options.params = files.folder() / "robot_a.yaml";
  options.set = {"stereo.window=30ms", "stereo.max_range=30m"};
  CHECK(number(files.load(options), "window") == doctest::Approx(0.03));
  CHECK(number(files.load(options), "max_range") == 30);
}

TEST_CASE("what is wrong in a parameter file is reported there") {
  const Split files(kHead + kConstants, kRobot, constant_nodes());
  const auto wrong = [&](const std::string& text, const std::string& at, const std::vector<std::string>& words) {
    CAPTURE(text);
    test::expect_at(files.with_params(text), "robot_a.yaml", text, at, words);
  };
  wrong("takt: 1\nconstants: {fat: 15m}\n", "fat", {"the graph has no constant `fat`", "did you mean `far`"});
  wrong("takt: 1\nconstants: {far: 90m}\n", "90m", {"`max_range` of node `stereo`", "90"});
  wrong("takt: 1\ngraph: other\n", "other", {"of another graph than `tiny`"});
  wrong("takt: 1\nnodes: {sterio: {window: 20ms}}\n", "sterio", {"none of the graph's nodes", "stereo"});
  wrong("takt: 1\nnodes: {stereo: {windows: 20ms}}\n", "windows", {"no parameter `windows`", "window"});
  wrong("takt: 1\nnodes: {stereo: {window: 20m}}\n", "20m", {"`window` of node `stereo`"});
  wrong("takt: 1\ndevices: {camera: {mount: {z: 7cm}}}\n", "z:", {"no setting `mount.z`"});
  wrong("takt: 1\ndevices: {camera: {mount: {x: 7kg}}}\n", "7kg", {"setting `mount.x` of device `camera`"});
  wrong("takt: 1\nnode: {}\n", "node:", {"unknown key `node` in the parameter file", "nodes"});
  LoadOptions options;
  options.params = files.folder() / "none.yaml";
  test::expect(files.load(options), "--params", 0, 0, {"none.yaml", "there is no such file"});
}

TEST_CASE("what `takt set --keep` left for a graph of several files wins over its parameter file") {
  const Split files(kHead + kConstants, kRobot, constant_nodes());
  std::filesystem::create_directories(files.folder() / "overlays");
  files.write("overlays/tiny.yaml", "takt: 1\ngraph: tiny\nvalues:\n  stereo.window: 40ms\n");
  files.write("robot_a.yaml", "takt: 1\nnodes: {stereo: {window: 20ms}}\n");
  LoadOptions options;
  options.params = files.folder() / "robot_a.yaml";
  options.state = files.folder();
  CHECK(number(files.load(options), "window") == doctest::Approx(0.04));
  files.write("overlays/tiny.yaml", "takt: 1\ngraph: tiny\nvalues:\n  stereo.window: 40m\n");
  test::expect(files.load(options), "tiny.yaml", 4, 18, {"`window` of node `stereo`", "--forget stereo.window"});
}
