// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "fixture.hpp"

using namespace takt;
using namespace takt::test;
using namespace takt::graph;

TEST_CASE("A node has a rate or follows a port, not both and not neither") {
  expect_schedule("planner: {rate: 1/3}", "planner: {rate: 1/3, on: ego_motion.motion}", "on: ego_motion.motion",
                  {"`planner` has both `rate` and `on`"});
  expect_schedule("planner: {rate: 1/3}", "planner: {budget: 1ms}", "planner", {"neither `rate` nor `on`"});
  expect(Files(kGraph, with(kSchedule, "  planner: {rate: 1/3}\n", "")).load(), "graph.yaml", 21, 5,
         {"node `planner` has no entry in the schedule", "schedule.yaml"});
  expect_schedule("planner: {rate: 1/3}", "planner: {rate: 1/3, every: 2}", "every: 2}",
                  {"`every` of `planner` goes with `on` only"});
  expect_schedule("every: 2, ", "offset: 2ms, ", "offset: 2ms", {"`offset` of `ego_motion` goes with `rate` only"});
}

TEST_CASE("Rates are positive numbers without a unit") {
  for (const char* rate : {"0", "-3", "often", "1/0", "15Hz", "1e9"}) {
    CAPTURE(rate);
    expect(Files(kGraph, with(kSchedule, "planner: {rate: 1/3}", std::string("planner: {rate: ") + rate + "}")).load(),
           "schedule.yaml", 10, 19, {"`rate` of `planner`", rate == std::string("15Hz") ? "write 15" : rate});
  }
}

TEST_CASE("Times carry units and are positive") {
  expect_schedule("budget: 12ms", "budget: 12", "12, dead", {"`budget` of the entry of `stereo`", "write 12ms"});
  expect_schedule("budget: 12ms", "budget: -12ms", "-12ms", {"`budget` of `stereo` is -12ms", "above 0"});
  expect_schedule("budget: 12ms", "budget: 0ms", "0ms, dead", {"above 0"});
  expect_schedule("deadline: 10ms", "deadline: 0ms", "0ms}", {"`deadline` of `camera`", "above 0"});
  expect_schedule("offset: 16ms", "offset: -1ms", "-1ms", {"must not be negative"});
  expect_schedule("min_interval: 100ms", "min_interval: -1s", "-1s", {"must not be negative"});
  expect_schedule("deadline: 1/15 s", "deadline: 67ms", "67ms", {"longer than its period of 66.6667ms", "15 Hz"});
}

TEST_CASE("A budget above its deadline is for the check, not for the loader") {
  CHECK(Files(kGraph, with(kSchedule, "deadline: 10ms", "deadline: 1ms")).load().graph.has_value());
}

TEST_CASE("Cores: at least one, each once") {
  expect_schedule("cores: [0, 1]", "cores: []", "[]", {"`cores` of the schedule has 0 entries"});
  expect_schedule("cores: [0, 1]", "cores: [0, 1, 0]", "0]", {"names `0` twice"});
  expect_schedule("rate: 1/3", "rate: 1/3, core: 2", "2}",
                  {"`core` of `planner` is 2, which is none of the schedule's; valid are: 0, 1"});
  expect_schedule("every: 2", "core: 1, every: 2", "1, every", {"`core` of `ego_motion` goes with `rate` only"});
  expect_schedule("rate: 1/3", "rate: 1/3, core: -1", "-1}", {"a number from 0 on"});
  expect_schedule("cores: [0, 1]", "cores: [-1]", "-1", {"a core number from 0 on"});
}

TEST_CASE("How early workers may be woken has bounds, and a unit") {
  expect_schedule("cores: [0, 1]", "anticipate: 2ms", "2ms", {"`anticipate` is 2ms; it must lie between 0ms and 1ms"});
  expect_schedule("cores: [0, 1]", "anticipate: -1us", "-1us", {"`anticipate` is -1us"});
  expect_schedule("cores: [0, 1]", "anticipate: 100", "100", {"`anticipate` of the schedule", "write 100ms"});
}

TEST_CASE("A graph without a node of high criticality is valid") {
  CHECK(Files(kGraph, with(kSchedule, "criticality: high", "criticality: low")).load().graph);
}

TEST_CASE("`on` follows an output that the node reads") {
  expect_schedule("on: stereo.disparity", "on: stereo.dispairty", "stereo.dispairty",
                  {"no output `dispairty`", "did you mean `disparity`?"});
  expect_schedule("on: stereo.disparity", "on: sterio.disparity", "sterio.disparity", {"did you mean `stereo`?"});
  expect_schedule("on: stereo.disparity", "on: camera.pair", "camera.pair",
                  {"none of its inputs reads", "stereo.disparity, stereo.rectified"});
}

TEST_CASE("A cycle of on edges") {
  const std::string text =
      with(kGraph, "in: {pair: stereo.rectified,", "in: {guess: ego_motion.motion, pair: stereo.rectified,");
  expect(Files(text, with(kSchedule, "on: stereo.disparity", "on: ego_motion.motion")).load(), "schedule.yaml", 9, 20,
         {"cycle of `on` edges: ego_motion -> ego_motion", "rate"});
}

TEST_CASE("A cycle of on edges through several nodes") {
  std::string text = with(kGraph, "in: {pair: stereo.rectified,", "in: {guess: planner.guess, pair: stereo.rectified,");
  // One subsystem of one layer would need other node types: the layer error is there too, the cycle must be named.
  const Loaded loaded = Files(text, with(with(kSchedule, "on: stereo.disparity", "on: planner.guess"),
                                         "planner: {rate: 1/3}", "planner: {on: ego_motion.motion}"))
                            .load();
  INFO(all(loaded));
  CHECK(std::count_if(loaded.problems.begin(), loaded.problems.end(), [](const Problem& p) {
          return p.text.find("cycle of `on` edges: ego_motion -> planner -> ego_motion") != std::string::npos;
        }) == 1);
}

TEST_CASE("A mode without the releaser of a node that stays") {
  const std::string text = with(kGraph, "[stereo, ego_motion, planner, base]", "[stereo]");
  const Loaded loaded = Files(text).load();
  INFO(all(loaded));
  CHECK(std::any_of(loaded.problems.begin(), loaded.problems.end(), [](const Problem& p) {
    return p.text.find("whose output `stereo.disparity` releases `ego_motion`") != std::string::npos;
  }));
}
