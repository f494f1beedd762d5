// SPDX-License-Identifier: Apache-2.0
// The language of scenarios: what it says, and one test per way to get it wrong.
#include "fixture.hpp"

using namespace takt;
using namespace takt::graph;
using namespace takt::test;

namespace {

/// Exactly one problem, there, whose text holds all the words.
void expect_problem(const std::string& text, int line, int column, const std::vector<std::string>& words,
                    const RunKind& run = {true, false, true}) {
  const LoadedScenario loaded = load(text, run);
  INFO(all(loaded));
  CHECK(!loaded.scenario);
  REQUIRE(loaded.problems.size() == 1);
  CHECK(loaded.problems[0].position.line == line);
  CHECK(loaded.problems[0].position.column == column);
  for (const auto& word : words) {
    CAPTURE(word);
    CHECK(loaded.problems[0].text.find(word) != std::string::npos);
  }
}

}  // namespace

TEST_CASE("a scenario in full") {
  const Scenario s = sound(R"(takt: 1
name: cameras_go
seed: 7
faults:
  - {kind: drop, target: camera.pair, from: 2s, to: 4s, probability: 0.5}
  - {kind: delay, target: stereo.disparity, by: 1/10 s}
  - {kind: clock_step, target: camera.pair, by: -5ms}
  - {kind: kill, target: stereo, at: 5s, for: 200ms}
  - {kind: kill, target: any, every: 3s, from: 5s, to: 60s}
  - {kind: hang, target: planner, at: 6s, for: 2s}
  - {kind: full_disk, from: 1s, megabytes: 2.5}
  - {kind: silent, target: camera, from: 1s, to: 2s}
expect:
  modes: [full, blind, full]
  rates: {stereo: 14.5, planner: {at_most: 3}}
  misses: {planner: 0}
  stale: {planner: {at_least: 1, at_most: 9}}
  restarts: {depth: 1, plan: {at_most: 3}}
  ages: {reaction: 300ms}
  recovery: 2s
  lost: 0
  exit: 1
)");
  CHECK(s.name == "cameras_go");
  CHECK(s.seed == 7);
  REQUIRE(s.faults.size() == 8);
  CHECK(s.faults[0].kind == FaultKind::drop);
  CHECK(s.faults[0].from_ns == 2'000 * kMs);
  CHECK(s.faults[0].to_ns == 4'000 * kMs);
  CHECK(s.faults[0].probability == 0.5);
  CHECK(s.faults[0].position.line == 5);
  CHECK(s.faults[1].by_ns == 100 * kMs);
  CHECK(s.faults[1].to_ns == faults::kForever);
  CHECK(s.faults[2].by_ns == -5 * kMs);
  CHECK(s.faults[3].ends_ns() == 5'200 * kMs);
  CHECK(s.faults[4].every_ns == 3'000 * kMs);
  CHECK(s.faults[5].for_ns == 2'000 * kMs);
  CHECK(s.faults[6].bytes == 2'500'000);
  CHECK(device_failures(s) == std::vector<DeviceFailure>{{"camera", FaultKind::silent, 1'000 * kMs, 2'000 * kMs}});
  const Expectations& e = s.expect;
  CHECK(e.modes == std::vector<std::string>{"full", "blind", "full"});
  CHECK(e.rates.at("stereo").holds(14.5));
  CHECK_FALSE(e.rates.at("stereo").holds(14.4));
  CHECK(e.rates.at("stereo").holds(100));
  CHECK_FALSE(e.rates.at("planner").holds(3.1));
  CHECK_FALSE(e.misses.at("planner").holds(1));
  CHECK_FALSE(e.stale.at("planner").holds(0));
  CHECK(e.restarts.at("depth").holds(1));
  CHECK_FALSE(e.restarts.at("depth").holds(2));
  CHECK_FALSE(e.restarts.at("depth").holds(0));
  CHECK(e.ages.at("reaction").holds(300e6));
  CHECK_FALSE(e.ages.at("reaction").holds(301e6));
  CHECK(e.recovery_ns == 2'000 * kMs);
  CHECK(e.exit == 1);
}

TEST_CASE("every kind has the place of its name in the schema and in the table") {
  const auto kinds = fault_kinds();
  for (size_t i = 0; i < kinds.size(); ++i) {
    CHECK(static_cast<size_t>(kinds[i].kind) == i);
    CHECK(find_fault_kind(kinds[i].name) == &kinds[i]);
    // The schema knows it: what is wrong is never the kind.
    const LoadedScenario loaded = load(test::scenario_text("{kind: " + std::string(kinds[i].name) + "}"));
    CHECK(all(loaded).find("`kind`") == std::string::npos);
  }
  CHECK(find_fault_kind("nothing") == nullptr);
}

TEST_CASE("unknown kinds, targets and keys, each with what was meant") {
  expect_problem(scenario_text("{kind: dropp, target: camera.pair}"), 4, 12, {"dropp", "did you mean `drop`?"});
  expect_problem(scenario_text("{kind: drop, target: camera.pear}"), 4, 26,
                 {"`drop` strikes an output", "no `camera.pear`", "did you mean `camera.pair`?", "planner.motion"});
  expect_problem(scenario_text("{kind: hang, target: sterio, at: 1s, for: 0s}"), 4, 26, {"did you mean `stereo`?"});
  expect_problem(scenario_text("{kind: silent, target: stereo}"), 4, 28, {"strikes a device", "camera"});
  expect_problem(scenario_text("{kind: kill, target: deepth, at: 1s}"), 4, 26,
                 {"did you mean `depth`?", "any", "devices"});
  expect_problem(scenario_text("{kind: drop, target: camera.pair, by: 5ms}"), 4, 39,
                 {"`drop` takes no `by`", "probability"});
  expect_problem(scenario_text("{kind: delay, target: camera.pair}"), 4, 5, {"`delay` lacks `by`"});
  expect_problem(scenario_text("{kind: drop}"), 4, 5, {"`drop` lacks `target`"});
  expect_problem(scenario_text("{kind: drop, target: camera.pair, probabilty: 1}"), 4, 39,
                 {"unknown key `probabilty`", "did you mean `probability`?"});
  expect_problem(scenario_text("{kind: truncate, target: planner.motion}"), 4, 30, {"no array"});
}

TEST_CASE("wrong times and amounts") {
  expect_problem(scenario_text("{kind: drop, target: camera.pair, from: 2}"), 4, 45, {"`from`", "without a unit"});
  expect_problem(scenario_text("{kind: drop, target: camera.pair, from: 2s, to: 1s}"), 4, 53, {"not after `from`"});
  expect_problem(scenario_text("{kind: drop, target: camera.pair, from: -2s}"), 4, 45, {"at least 0ns"});
  expect_problem(scenario_text("{kind: delay, target: camera.pair, by: 0s}"), 4, 44, {"at least 1ns"});
  expect_problem(scenario_text("{kind: drop, target: camera.pair, probability: 2}"), 4, 52, {"from 0 to 1"});
  expect_problem(scenario_text("{kind: kill, target: depth}"), 4, 5, {"either `at`, or `every`"});
  expect_problem(scenario_text("{kind: kill, target: depth, every: 1s}"), 4, 5, {"lacks `to`"});
  expect_problem(scenario_text("{kind: kill, target: depth, every: 1ms, to: 11s}"), 4, 40, {"more than 10000 times"});
  expect_problem(scenario_text("{kind: kill, target: depth, at: 1s, to: 3s}"), 4, 5, {"no `from` and `to`"});
}

TEST_CASE("expectations of what the graph does not have") {
  const std::string fault = "{kind: drop, target: camera.pair}";
  expect_problem(scenario_text(fault, "{rates: {sterio: 1}}"), 5, 18,
                 {"`rates` names `sterio`", "did you mean `stereo`?"});
  expect_problem(scenario_text(fault, "{restarts: {stereo: 1}}"), 5, 21, {"subsystems", "depth"});
  expect_problem(scenario_text(fault, "{ages: {reactoin: 1s}}"), 5, 17, {"did you mean `reaction`?"});
  expect_problem(scenario_text(fault, "{ages: {reaction: 1}}"), 5, 27, {"without a unit"});
  expect_problem(scenario_text(fault, "{modes: [full, blid]}"), 5, 24, {"no mode `blid`", "did you mean `blind`?"});
  expect_problem(scenario_text(fault, "{rates: {stereo: {}}}"), 5, 26, {"lacks at_least, at_most"});
  expect_problem(scenario_text(fault, "{exit: 4}"), 5, 16, {"0 to 3"});
  expect_problem(scenario_text(fault, "{missed: {stereo: 0}}"), 5, 10,
                 {"unknown key `missed`", "did you mean `misses`?"});
}

TEST_CASE("a step of a message's life belongs to its writer or to a reader of it") {
  const RunKind processes{false, true, false};
  const auto step = [](const std::string& keys) {
    return scenario_text("{kind: kill_at_step, target: stereo.disparity, at: 1s, " + keys + "}");
  };
  const auto sound = load(step("step: inside_publish"), processes);
  REQUIRE(sound.scenario);
  CHECK(sound.scenario->faults[0].step == MessageStep::inside_publish);
  CHECK(load(step("step: while_held, reader: planner"), processes).scenario);
  expect_problem(step("step: while_held"), 4, 66, {"`while_held`", "name it as `reader`"}, processes);
  expect_problem(step("step: after_loan, reader: planner"), 4, 66, {"`after_loan`", "leave `reader` out"}, processes);
  expect_problem(step("step: while_held, reader: stereo"), 4, 86, {"`stereo` does not read", "planner"}, processes);
  expect_problem(step("step: inside_loan"), 4, 66, {"iceoryx has no step `inside_loan`", "--transport local"},
                 {false, true, false, true});
}

TEST_CASE("faults that such a run cannot have") {
  const RunKind virtual_time{true, false, false}, one_process{false, false, true}, processes{false, true, true};
  expect_problem(scenario_text("{kind: cpu_hog}"), 4, 12, {"real time only", "--clock real"}, virtual_time);
  expect_problem(scenario_text("{kind: kill, target: depth, at: 1s}"), 4, 12,
                 {"--isolate subsystem", "--clock virtual"}, one_process);
  expect_problem(scenario_text("{kind: stop_process, target: depth, at: 1s, for: 1s}"), 4, 12, {"--isolate subsystem"},
                 one_process);
  expect_problem(scenario_text("{kind: full_disk, megabytes: 1}"), 4, 12, {"--record FILE"}, virtual_time);
  expect_problem(scenario_text("{kind: exhausted_pool, target: camera.pair}"), 4, 12, {"iceoryx", "--transport local"},
                 {true, false, false, true});
  sound(scenario_text("{kind: kill, target: depth, at: 1s}"), processes);
  sound(scenario_text("{kind: cpu_hog, threads: 2, policy: fixed}"), one_process);
}

TEST_CASE("all problems at once, in the order of the file") {
  const LoadedScenario loaded = load(R"(takt: 1
name: Test
faults:
  - {kind: drop, target: camera.pear}
  - {kind: delay, target: camera.pair}
  - {kind: slow_consumer, target: stereo, by: 5}
expect: {misses: {sterio: 0}}
)");
  INFO(all(loaded));
  REQUIRE(loaded.problems.size() == 5);
  for (size_t i = 0; i + 1 < 5; ++i) CHECK(loaded.problems[i].position.line < loaded.problems[i + 1].position.line);
}

TEST_CASE("a file that is none") {
  CHECK(all(load("takt: 1\nname: test\n")).find("lacks `faults`") != std::string::npos);
  CHECK(all(load("takt: 1\nname: test\nfaults: []\n")).find("0 entries") != std::string::npos);
  CHECK(!load("[]").scenario);
  CHECK(!load("").scenario);
  CHECK(!load("takt: 1\nname: test\nfaults: [1, {kind: 2}, {}]\nexpect: 5\n").scenario);
  const auto none = load_scenario("nowhere/faults.yaml", small_graph(), small_plan(), {});
  REQUIRE(none.problems.size() == 1);
  CHECK(none.problems[0].text.find("no such file") != std::string::npos);
}
