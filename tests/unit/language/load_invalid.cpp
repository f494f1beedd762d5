// SPDX-License-Identifier: Apache-2.0
// One test per way to get a graph wrong: where the error stands and which words help.
#include <algorithm>

#include "fixture.hpp"

using namespace takt;
using namespace takt::test;
using namespace takt::graph;

namespace {

struct OtherPair {
  static constexpr std::string_view type_name = "stereo_pair";
  double width = 0;
  TAKT_FIELDS(OtherPair, (width, "px"))
};

}  // namespace

TEST_CASE("Misspelt output and input ports") {
  expect_graph("disparity: {from: stereo.disparity,", "disparity: {from: stereo.disparty,", "stereo.disparty",
               {"`stereo`", "no output `disparty`", "did you mean `disparity`?", "disparity, rectified"});
  const std::string text = with(kGraph, "in: {pair: camera.pair}", "in: {pear: camera.pair}");
  const Loaded loaded = Files(text).load();
  INFO(all(loaded));
  REQUIRE(loaded.problems.size() == 2);
  CHECK(loaded.problems[0].position.line == 14);
  CHECK(loaded.problems[0].position.column == 5);
  CHECK(loaded.problems[0].text.find("input `pair` of node `stereo` is not connected") != std::string::npos);
  CHECK(loaded.problems[0].text.find("camera.pair") != std::string::npos);
  CHECK(loaded.problems[1].position.column == 33);
  CHECK(loaded.problems[1].text.find("no input `pear`; did you mean `pair`?") != std::string::npos);
}

TEST_CASE("Unknown node type, device kind, driver and profile") {
  expect_graph("stereo: {type: stereo,", "stereo: {type: sterio,", "sterio",
               {"node `stereo`", "unknown type `sterio`", "did you mean `stereo`?", "ego_motion, planner, stereo"});
  expect_graph("kind: mobile_base", "kind: mobile_bass", "mobile_bass",
               {"device `base`", "unknown kind", "did you mean `mobile_base`?", "stereo_camera"});
  expect_graph("sim: {default: {driver: sim, world: lab.xml}}",
               "sim: {default: {driver: sim, world: lab.xml}, camera: {driver: v4l}}", "v4l}",
               {"device `camera`", "unknown driver `v4l`", "did you mean `v4l2`?", "sim, v4l2"});
  expect_graph("default_profile: sim", "default_profile: simm", "simm",
               {"no profile `simm`", "did you mean `sim`?", "robot"});
}

TEST_CASE("Unknown ids") {
  expect_graph("in: {motion: ego_motion.motion}", "in: {motion: ego_notion.motion}", "ego_notion",
               {"no node or device `ego_notion`", "did you mean `ego_motion`?"});
  expect_graph("exports: [ego_motion.motion]", "exports: [ego_motion.motion, planner.velocity]", "planner.velocity]",
               {"subsystem `depth` exports `planner.velocity`", "no node `planner`", "ego_motion, stereo"});
  expect_graph("exports: [ego_motion.motion]", "exports: [ego_motion.motion, stereo.dispartiy]", "stereo.dispartiy",
               {"no output `dispartiy`", "did you mean `disparity`?"});
  expect_graph("robot: {camera:", "robot: {kamera:", "kamera",
               {"profile `robot`", "`kamera`", "did you mean `camera`?"});
  expect_graph("sim: {default:", "sim: {set: {stero.disparities: 3}, default:", "stero.disparities",
               {"profile `sim` sets `stero`, which is no node", "did you mean `stereo`?"});
  expect_graph("sim: {default:", "sim: {set: {stereo.disparties: 3}, default:", "stereo.disparties",
               {"node `stereo`", "`disparties`", "did you mean `disparities`?"});
  expect_graph("sim: {default:", "sim: {set: {stereo: 3}, default:", "stereo: 3",
               {"`stereo` is not understood", "node.param: value"});
  expect_schedule("  planner: {rate: 1/3}", "  planner: {rate: 1/3}\n  planer: {rate: 2}",
                  "planer:", {"`planer`", "no such node or device", "did you mean `planner`?"});
}

TEST_CASE("Duplicate ids: in one map, across subsystems, with a device") {
  expect_graph("chains:", "    planner: {type: planner, in: {motion: ego_motion.motion}}\nchains:",
               "planner: {type: planner, in: {motion: ego_motion.motion}}\nchains",
               {"duplicate key `planner`", "line 21"});
  expect_graph("chains:", "    stereo: {type: stereo, in: {pair: camera.pair}}\nchains:",
               "stereo: {type: stereo, in: {pair: camera.pair}}\nchains", {"duplicate id `stereo`", "graph.yaml:14:5"});
  expect_graph("chains:", "    camera: {type: stereo, in: {pair: camera.pair}}\nchains:",
               "camera: {type: stereo, in: {pair: camera.pair}}\nchains", {"duplicate id `camera`", "graph.yaml:6:3"});
}

TEST_CASE("Parameters: unknown, wrong kind, out of range, missing unit, wrong unit") {
  expect_graph("disparities: 150", "disparitys: 150", "disparitys",
               {"node `stereo`", "no parameter `disparitys`", "did you mean `disparities`?"});
  expect_graph("disparities: 150", "disparities: 1.5", "1.5",
               {"parameter `disparities` of node `stereo`", "an integer is wanted"});
  expect_graph("disparities: 150", "fill: 3", "3, max", {"parameter `fill`", "true or false is wanted"});
  expect_graph("disparities: 150", "disparities: true", "true", {"an integer is wanted"});
  expect_graph("disparities: 150", "table: 7", "7, max", {"a text is wanted"});
  expect_graph("disparities: 150", "cost: ssd", "ssd", {"`cost`", "\"ssd\"", "sad | census"});
  expect_graph("disparities: 150", "disparities: 9999", "9999", {"is 9999", "1..512"});
  expect_graph("max_range: 20m", "max_range: 0.1m", "0.1m", {"is 0.1", "0.5..50", "(in m)"});
  expect_graph("max_range: 20m", "max_range: 20", "20}", {"`max_range`", "20 without a unit", "write 20m", "cm"});
  expect_graph("max_range: 20m", "max_range: 0.3", "0.3}", {"write 0.3m"});
  expect_graph("max_range: 20m", "max_range: 20s", "20s", {"`s`", "m | cm | mm | km"});
  expect_graph("max_range: 20m", "max_range: far", "far", {"`far`", "no number"});
  expect_graph("disparities: 150", "disparities: 150mm", "150mm", {"carries no unit: write 150"});
  expect_graph("rate: 10, in", "rate: 10Hz, in", "10Hz", {"device `base`", "carries no unit: write 10"});
}

TEST_CASE("Unknown keys and wrong types, with the valid ones") {
  expect_graph("    planner: {type: planner, in:", "    planner: {type: planner, on: camera.pair, in:",
               "on: camera.pair", {"unknown key `on` in node `planner`", "in, join, params, type"});
  expect_graph("name: tiny", "name: tiny\nnmae: x", "nmae",
               {"unknown key `nmae` in the graph", "did you mean `name`?"});
  expect_graph("depth: 3", "depth: 65", "65", {"`depth` of input `disparity` of node `ego_motion`", "1 to 64"});
  expect_graph("depth: 3", "depth: three", "three", {"an integer from 1 to 64"});
  expect_graph("max_age: 150ms", "max_age: 150", "150}", {"`max_age` of input `disparity`", "write 150ms"});
  expect_graph("takt: 1", "takt: 0", "0", {"`takt` of the graph is `0`", "1"});
  expect_graph("takt: 1\n", "takt: 2\nfuture: {}\n", "2", {"version 2", "reads version 1", "a later Takt"});
  expect_schedule("takt: 1\n", "takt: 2\nfuture: {}\n", "2", {"version 2", "reads version 1", "a later Takt"});
  expect_graph("name: tiny\n", "", "takt", {"the graph lacks `name`"});
  expect_graph("blind: {without: [stereo, ego_motion, planner, base]}", "blind: {}", "blind",
               {"mode `blind` lacks `without`"});
  expect_graph("sim: {default: {driver: sim, world: lab.xml}}",
               "sim: {default: {driver: sim, wrld: x, world: lab.xml}}", "wrld",
               {"no device of profile `sim` takes the setting `wrld`", "did you mean `world`?"});
  expect_graph("rig: rigs/a.yaml", "rgi: rigs/a.yaml", "rgi", {"no setting `rgi`", "did you mean `rig`?"});
  expect_graph("x: 30cm", "x: 0.3", "0.3", {"`mount.x` of device `camera`", "write 0.3m"});
  expect_schedule("policy: fixed", "policy: fixxed", "fixxed",
                  {"did you mean `fixed`?", "cooperative, deadline, fixed"});
  expect_schedule("on_miss: skip", "memory: 64", "64, publish", {"`memory` of", "64 without a unit", "MB"});
  expect_schedule("on_miss: skip", "on_miss: ignore", "ignore", {"`on_miss`", "continue, reuse_last, safe_stop, skip"});
  expect_schedule("on_overrun: degrade", "on_overun: degrade", "on_overun", {"did you mean `on_overrun`?"});
}

TEST_CASE("YAML traps are named") {
  expect_graph("disparities: 150", "disparities: 0150", "0150", {"leading zero", "write 150"});
  expect_graph("disparities: 150", "fill: no", "no, max", {"truth value", "true or false"});
  expect_graph("disparities: 150", "gain: 1_000", "1_000", {"without `_`"});
  expect_graph("disparities: 150", "gain: 0x10", "0x10", {"decimal"});
  expect_graph("disparities: 150", "gain: 1:30", "1:30", {"base-60"});
  expect_graph("disparities: 150", "<<: {gain: 1}", "<<", {"merge keys"});
  expect_graph("{disparities: 150", "&p {disparities: 150", "&p", {"anchors"});
  expect_graph("disparities: 150", "fill: !!str true", "!!str", {"tags"});
  expect(Files(kGraph + "---\ntakt: 1\n").load(), "graph.yaml", 27, 1, {"second YAML document"});
  const Loaded broken = Files("takt: 1\nname: [x\n").load();
  REQUIRE(broken.problems.size() == 1);
  CHECK(broken.problems[0].position.line >= 2);
  const Loaded binary = Files("takt: 1\nname: a\xff\n").load();
  expect(binary, "graph.yaml", 2, 8, {"UTF-8"});
  expect(Files("").load(), "graph.yaml", 1, 1, {"empty"});
  expect(Files("7").load(), "graph.yaml", 1, 1, {"wanted: a map that begins with `takt: 1`"});
}

TEST_CASE("Type mismatch") {
  expect_graph("disparity: {from: stereo.disparity,", "disparity: {from: stereo.rectified,", "stereo.rectified, depth",
               {"type mismatch", "`stereo_pair`", "`disparity`", "`ego_motion`"});
}

TEST_CASE("Two declarations of one type with other fields") {
  const Files files;
  DeviceCatalogue devices = fake_devices();
  devices.kinds["stereo_camera"].ports[0].type = &MessageType::of<OtherPair>();
  expect(load(files.folder() / "graph.yaml", {}, fake_types(), devices), "graph.yaml", 14, 39,
         {"`camera.pair` and input `pair` of node `stereo` both call their type `stereo_pair`, but with other fields"});
}

TEST_CASE("An edge must go to the same, the next or the storage layer, in a graph that asks for it") {
  std::string text = with(kGraph, "in: {pair: stereo.rectified,", "in: {guess: planner.guess, pair: stereo.rectified,");
  text = with(text, "exports: [planner.velocity]", "exports: [planner.velocity, planner.guess]");
  CHECK(Files(text).load().graph);
  expect(Files(with(text, "name: tiny\n", "name: tiny\nlayers: thesis\n")).load(), "graph.yaml", 18, 19,
         {"`planner.guess` (layer processing)", "`ego_motion` (layer perception)", "`layers: thesis`"});
  CHECK(Files(with(kGraph, "name: tiny\n", "name: tiny\nlayers: thesis\n")).load().graph);
  expect_graph("name: tiny\n", "name: tiny\nlayers: these\n", "these", {"these", "thesis"});
}

TEST_CASE("An edge against the hierarchy") {
  expect_graph("exports: [ego_motion.motion]", "exports: [stereo.disparity]", "ego_motion.motion}}",
               {"against the hierarchy", "`ego_motion.motion` leaves subsystem `depth`", "exported: stereo.disparity"});
}

TEST_CASE("Joins name inputs that are there and connected") {
  expect_graph("join: [pair, disparity]", "join: [pair, disparityy]", "disparityy",
               {"`join` of node `ego_motion`", "did you mean `disparity`?"});
  expect_graph("join: [pair, disparity]", "join: [pair, guess]", "guess]", {"not connected"});
  expect_graph("join: [pair, disparity]", "join: [pair]", "[pair]", {"at least two"});
}

TEST_CASE("A subsystem has a spare or has none") {
  expect_graph("exports: [ego_motion.motion]", "spare: maybe\n    exports: [ego_motion.motion]", "maybe",
               {"`spare` of subsystem `depth` is `maybe`", "wanted: true or false"});
  const Loaded loaded =
      Files(with(kGraph, "exports: [ego_motion.motion]", "spare: true\n    exports: [ego_motion.motion]")).load();
  INFO(all(loaded));
  REQUIRE(loaded.graph);
  CHECK(loaded.graph->subsystems[0].spare == true);
  CHECK_FALSE(loaded.graph->subsystems[1].spare);
}

TEST_CASE("Unconnected required inputs") {
  expect_graph("in: {motion: ego_motion.motion}", "params: {}", "planner: {type",
               {"input `motion` of node `planner` is not connected", "these give: ego_motion.motion"});
}

TEST_CASE("Chains lead along edges") {
  expect_graph("to: planner.velocity,", "to: planner.speed,", "planner.speed", {"chain `reaction`", "no port `speed`"});
  expect_graph("from: camera.pair, to", "from: kamera.pair, to", "kamera.pair", {"did you mean `camera`?"});
  expect_graph("from: camera.pair, to", "from: base.odometry, to", "reaction", {"no path of edges", "`base.odometry`"});
  expect_graph("max_age: 700ms", "max_age: -700ms", "-700ms", {"above 0"});
}

TEST_CASE("Modes leave nothing unconnected") {
  expect_graph("[stereo, ego_motion, planner, base]", "[stereo, ego_motion, planer, base]", "planer, base",
               {"mode `blind`", "did you mean `planner`?"}, {});
}

TEST_CASE("A mode that cuts a needed input off is refused, an optional one is not") {
  const Loaded loaded = Files(with(kGraph, "[stereo, ego_motion, planner, base]", "[planner]")).load();
  INFO(all(loaded));
  CHECK(loaded.graph.has_value());  // the base's velocity is optional
  expect_graph("[stereo, ego_motion, planner, base]", "[ego_motion]", "blind",
               {"mode `blind` leaves input `motion` of `planner` unconnected", "without `ego_motion`"});
}

TEST_CASE("What a mode can do without is a device, named once; safe_stop needs nothing else") {
  const std::string blind = "blind: {without: [stereo, ego_motion, planner, base]}";
  const auto lost = [&](const std::string& devices) {
    return "blind: {without: [stereo, ego_motion, planner, base], lost: [" + devices + "]}";
  };
  expect_graph(blind, lost("camra"), "camra", {"mode `blind`", "`camra`", "did you mean `camera`?"});
  expect_graph(blind, lost("stereo"), "stereo]", {"mode `blind`", "`stereo`, which is no device", "base, camera"});
  expect_graph(blind, lost("base, camera, camera"), "camera]}", {"`lost` of mode `blind` names `camera` twice"});
  expect_graph(blind, "blind: {lost: [camera]}", "blind", {"mode `blind` lacks `without`"});
  expect_graph(blind, "safe_stop: {}", "safe_stop", {"mode `safe_stop` lacks `without`"});
  expect_graph(blind, "safe_stop: {lost: []}", "safe_stop", {"mode `safe_stop` lacks `without`"});
  LoadOptions options;
  options.mode = "safe_stop";
  const Loaded loaded = Files(with(kGraph, blind, "safe_stop: {lost: [camera]}")).load(options);
  INFO(all(loaded));
  CHECK_FALSE(loaded.graph);  // as little a mode to start in as without the rule
}

TEST_CASE("The command line's words") {
  const auto at = [](const LoadOptions& options) {
    const Loaded loaded = Files().load(options);
    INFO(all(loaded));
    REQUIRE(loaded.problems.size() == 1);
    CHECK(loaded.problems[0].position.line == 0);
    return to_string(loaded.problems[0]);
  };
  LoadOptions options;
  options.mode = "blnd";
  CHECK(at(options).find("--mode: error: graph `tiny` has no mode `blnd`; did you mean `blind`?") == 0);
  options = {};
  options.profile = "robo";
  CHECK(at(options).find("--profile: error: graph `tiny` has no profile `robo`; did you mean `robot`?") == 0);
  options = {};
  options.policy = "fifo";
  CHECK(at(options).find("cooperative, deadline, fixed") != std::string::npos);
  for (const auto& [text, words] :
       std::vector<std::pair<std::string, std::string>>{{"stereo.disparities", "write --set node.param=value"},
                                                        {"disparities=3", "write --set node.param=value"},
                                                        {"stereo.disparities=", "no value"},
                                                        {"stero.disparities=3", "did you mean `stereo`?"},
                                                        {"stereo.disparties=3", "did you mean `disparities`?"},
                                                        {"stereo.disparities=0", "must lie in 1..512"},
                                                        {"stereo.max_range=0.3", "write 0.3m"},
                                                        {"stereo.disparities=010", "leading zero"},
                                                        {"camera.rgi=x", "did you mean `rig`?"}}) {
    options = {};
    options.set = {text};
    CAPTURE(text);
    const std::string said = at(options);
    CHECK(said.find("--set: error: ") == 0);
    CAPTURE(said);
    CHECK(said.find(words) != std::string::npos);
  }
}

TEST_CASE("Files that are not there") {
  static const NodeTypes types = fake_types();
  const Loaded none = takt::graph::load("/nowhere/graph.yaml", {}, types, fake_devices());
  REQUIRE(none.problems.size() == 1);
  CHECK(none.problems[0].text.find("no such file") != std::string::npos);
  expect_graph("schedule: schedule.yaml", "schedule: schedul.yaml", "schedul.yaml",
               {"cannot read", "schedul.yaml", "no such file"});
  expect_graph("schedule: schedule.yaml\n", "", "takt", {"names no schedule", "--schedule"});
}

TEST_CASE("All problems at once, in the order of the file") {
  std::string text = with(kGraph, "disparities: 150", "disparities: 9999");
  text = with(text, "type: planner", "type: plannner");
  text = with(text, "from: stereo.disparity", "from: stereo.dsparity");
  const std::string schedule = with(with(kSchedule, "budget: 2ms", "budget: 2"), "planner: {rate: 1/3}", "planner: {}");
  const Loaded loaded = Files(text, schedule).load();
  INFO(all(loaded));
  REQUIRE(loaded.problems.size() == 5);
  const std::vector<std::tuple<std::string, int, int>> expected{{"graph.yaml", 14, 75},
                                                                {"graph.yaml", 17, 54},
                                                                {"graph.yaml", 21, 21},
                                                                {"schedule.yaml", 6, 30},
                                                                {"schedule.yaml", 10, 3}};
  for (size_t i = 0; i < expected.size(); ++i) {
    const auto& [file, line, column] = expected[i];
    CHECK(std::filesystem::path(loaded.problems[i].position.file).filename().string() == file);
    CHECK(loaded.problems[i].position.line == line);
    CHECK(loaded.problems[i].position.column == column);
  }
}
