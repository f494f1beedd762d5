// SPDX-License-Identifier: Apache-2.0
// Each expectation met, and unmet: a verdict that cannot fail says nothing.
#include "graph/faults/verdict.hpp"

#include "fixture.hpp"

using namespace takt;
using namespace takt::graph;
using namespace takt::test;
using Json = nlohmann::ordered_json;

namespace {

Json node(const char* name, uint64_t completed, uint64_t released, uint64_t misses, const char* criticality = "low") {
  return {{"name", name},         {"rate_hz", 10.0},        {"active_s", 10.0},          {"criticality", criticality},
          {"released", released}, {"completed", completed}, {"deadline_misses", misses}, {"stale_inputs", 3},
          {"no_result", 20}};
}

/// Ten seconds; stereo is high.
Json report() {
  return {{"modes", {{{"name", "full"}}, {{"name", "blind"}}}},
          {"nodes", {node("camera", 100, 100, 0), node("stereo", 100, 100, 0, "high"), node("planner", 90, 100, 2)}},
          {"chains", {{{"name", "reaction"}, {"age_ms", {{"max", 120.0}}}}}},
          {"recorder_lost", 0},
          {"faults", Json::array()}};
}

RunEvents events() {
  RunEvents e;
  e.struck = {5};
  e.end_ns = 10'000 * kMs;
  return e;
}

/// What is unmet of a run with a fault at the camera from 2 s to 3 s and those expectations.
std::vector<std::string> unmet(const std::string& expect, const RunEvents& e = events(), const Json& r = report()) {
  const Scenario s = sound(test::scenario_text("{kind: drop, target: camera.pair, from: 2s, to: 3s}", expect));
  std::vector<std::string> what;
  for (const Finding& finding : verdict(s, r, e))
    if (!finding.met) what.push_back(finding.what);
  return what;
}

using Words = std::vector<std::string>;

}  // namespace

TEST_CASE("a run that shows what is expected") {
  CHECK(unmet("{}").empty());
  CHECK(unmet("{modes: [full, blind], rates: {stereo: 10, planner: {at_most: 9}}, misses: {planner: 2}, stale: "
              "{stereo: 3}, "
              "ages: {reaction: 120ms}, restarts: {depth: 0}, recovery: 0s, lost: 0}")
            .empty());
}

TEST_CASE("modes: others, fewer, in another order") {
  CHECK(unmet("{modes: [full]}") == Words{"modes"});
  CHECK(unmet("{modes: [blind, full]}") == Words{"modes"});
  CHECK(unmet("{modes: [full, blind, full]}") == Words{"modes"});
}

TEST_CASE("rates, misses, stale inputs and ages out of their bounds") {
  CHECK(unmet("{rates: {planner: 9.1}}") == Words{"rate of planner"});
  CHECK(unmet("{rates: {stereo: {at_most: 9.9}}}") == Words{"rate of stereo"});
  CHECK(unmet("{results: {planner: 7}}").empty());  // 90 jobs, 20 of them without
  CHECK(unmet("{results: {planner: 7.1}}") == Words{"results of planner"});
  CHECK(unmet("{misses: {planner: 1}}") == Words{"misses of planner"});
  CHECK(unmet("{misses: {planner: {at_least: 3}}}") == Words{"misses of planner"});
  CHECK(unmet("{stale: {stereo: 2}}") == Words{"stale of stereo"});
  CHECK(unmet("{ages: {reaction: 119ms}}") == Words{"oldest of reaction"});
  CHECK(unmet("{ages: {reaction: {at_least: 121ms}}}") == Words{"oldest of reaction"});
}

TEST_CASE("what the report does not have is no proof") {
  Json without = report();
  without["nodes"].erase(2);
  without["chains"][0]["age_ms"]["max"] = nullptr;
  CHECK(unmet("{rates: {planner: 0}, misses: {planner: 9}, ages: {reaction: 1s}}", events(), without) ==
        Words{"rate of planner", "misses of planner", "oldest of reaction"});
}

TEST_CASE("restarts: exactly, at most, of that process") {
  RunEvents e = events();
  e.restarts = {{"depth", 2'000 * kMs, 2'300 * kMs}, {"depth", 5'000 * kMs, 5'300 * kMs}};
  CHECK(unmet("{restarts: {depth: 2, plan: 0}}", e).empty());
  CHECK(unmet("{restarts: {depth: 1}}", e) == Words{"restarts of depth"});
  CHECK(unmet("{restarts: {plan: 1}}", e) == Words{"restarts of plan"});
  CHECK(unmet("{restarts: {depth: {at_most: 1}}}", e) == Words{"restarts of depth"});
}

TEST_CASE("recovery: from the end of a fault to the last sign of it") {
  RunEvents e = events();
  e.unwell = {{"planner", 2'500 * kMs}, {"planner", 3'400 * kMs}};
  CHECK(unmet("{recovery: 400ms}", e).empty());
  CHECK(unmet("{recovery: 399ms}", e) == Words{"recovery"});
  e.unwell.push_back({"stereo", 9'000 * kMs});
  CHECK(unmet("{recovery: 1s}", e) == Words{"recovery"});
  e.unwell.clear();
  e.restarts = {{"depth", 2'000 * kMs, 2'600 * kMs}};
  CHECK(unmet("{recovery: 600ms}", e).empty());
  CHECK(unmet("{recovery: 599ms}", e) == Words{"recovery"});
}

TEST_CASE("recovery: what the next fault causes is not laid to this one; no end, no recovery") {
  const Scenario two = sound(
      "takt: 1\nname: t\nfaults: [{kind: drop, target: camera.pair, from: 2s, to: 3s},\n"
      " {kind: hang, target: planner, at: 5s, for: 0s}]\nexpect: {recovery: 500ms}\n");
  RunEvents e = events();
  e.struck = {1, 1};
  e.struck_nodes = {"planner"};
  e.unwell = {{"planner", 6'000 * kMs}};
  for (const Finding& finding : verdict(two, report(), e)) CHECK_MESSAGE(finding.met, finding.what);
  e.end_ns = 2'500 * kMs;
  size_t failed = 0;
  for (const Finding& finding : verdict(two, report(), e)) {
    if (finding.met) continue;
    ++failed;
    CHECK(finding.what == "recovery");
  }
  CHECK(failed == 1);
}

TEST_CASE("lost: by the recorder, or on the way") {
  RunEvents e = events();
  e.unaccounted = 1;
  CHECK(unmet("{lost: 0}", e) == Words{"lost"});
  CHECK(unmet("{lost: 1}", e).empty());
  Json r = report();
  r["recorder_lost"] = 2;
  CHECK(unmet("{lost: 0}", events(), r) == Words{"lost"});
  CHECK(unmet("{lost: {at_least: 3}}", events(), r) == Words{"lost"});
}

TEST_CASE("exit: as stated, else 0 or 1") {
  RunEvents e = events();
  e.exit = 1;
  CHECK(unmet("{}", e).empty());
  CHECK(unmet("{exit: 0}", e) == Words{"exit"});
  CHECK(unmet("{exit: 1}", e).empty());
  e.exit = 3;
  CHECK(unmet("{}", e) == Words{"exit"});
  CHECK(unmet("{exit: 3}", e).empty());
}

TEST_CASE("a fault that never struck proves nothing") {
  RunEvents e = events();
  e.struck = {0};
  CHECK(unmet("{}", e) == Words{"faults"});
}

TEST_CASE("high nodes that no fault strikes keep their promises, unless the file says otherwise") {
  Json r = report();
  r["nodes"][1]["deadline_misses"] = 1;
  CHECK(unmet("{}", events(), r) == Words{"high nodes not struck"});
  CHECK(unmet("{misses: {stereo: 1}}", events(), r).empty());
  r = report();
  r["nodes"][1]["completed"] = 98;
  CHECK(unmet("{}", events(), r) == Words{"high nodes not struck"});
  CHECK(unmet("{rates: {stereo: 9}}", events(), r).empty());
  RunEvents e = events();
  e.struck_nodes = {"stereo"};
  CHECK(unmet("{}", e, r).empty());
  r["nodes"][1]["completed"] = 99;
  CHECK(unmet("{}", events(), r).empty());
}

TEST_CASE("a node that no fault strikes must not hang or throw") {
  Json r = report();
  r["faults"].push_back({{"what", "planner: job 3 threw: no"}, {"node", "planner"}});
  CHECK(unmet("{}", events(), r) == Words{"nodes not struck"});
  RunEvents e = events();
  e.struck_nodes = {"planner"};
  CHECK(unmet("{}", e, r).empty());
}

TEST_CASE("the report says it all, and the table for people, too") {
  const Scenario s = sound(test::scenario_text("{kind: drop, target: camera.pair}", "{misses: {planner: 0}}"));
  const auto findings = verdict(s, report(), events());
  const Json json = scenario_json(s, events(), findings);
  CHECK(json["name"] == "test");
  CHECK(json["faults"][0]["kind"] == "drop");
  CHECK(json["faults"][0]["target"] == "camera.pair");
  CHECK(json["faults"][0]["struck"] == 5);
  CHECK(json["expectations"][0] ==
        Json{{"what", "misses of planner"}, {"expected", "at most 0"}, {"observed", "2"}, {"met", false}});
  CHECK(json["met"] == false);
  const std::string text = graph::scenario_text(json);
  CHECK(text.find("NO  misses of planner") != std::string::npos);
  CHECK(text.find("SCENARIO NOT MET") != std::string::npos);
}
