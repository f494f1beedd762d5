// SPDX-License-Identifier: Apache-2.0
// The part `expect` of a graph: what is understood, and one test per way to get it wrong.
#include "fixture.hpp"

using namespace takt;
using namespace takt::test;
using namespace takt::graph;

namespace {

std::string graph_with(const std::string& conditions, const std::string& more = "") {
  return kGraph + "expect:\n  within: 30s\n" + (conditions.empty() ? "" : "  all:\n") + conditions + more;
}

ExpectSpec sound(const std::string& text) {
  Loaded loaded = Files(text).load();
  INFO(all(loaded));
  REQUIRE(loaded.graph);
  REQUIRE(loaded.graph->expect);
  return *loaded.graph->expect;
}

ConditionSpec condition(const std::string& text) {
  const ExpectSpec expect = sound(graph_with("    - {" + text + "}\n"));
  REQUIRE(expect.conditions.size() == 1);
  return expect.conditions[0];
}

/// One problem, at the first `at` behind `expect:`.
void wrong(const std::string& text, const std::string& at, const std::vector<std::string>& words) {
  const std::string graph = graph_with("    - {" + text + "}\n");
  expect_at(Files(graph).load(), "graph.yaml", graph, at, words, kGraph.size());
}

}  // namespace

TEST_CASE("a graph without expectations has none") { CHECK_FALSE(Files().load().graph->expect); }

TEST_CASE("conditions on ports: counts, numbers with units, texts, windows") {
  ConditionSpec c = condition("port: stereo.disparity, messages: 3, from: 1s, to: 1500ms");
  CHECK(c.of == ConditionSpec::Of::messages);
  CHECK(c.port.text() == "stereo.disparity");
  CHECK(c.bound.at_least == 3);
  CHECK_FALSE(c.bound.at_most);
  CHECK(c.from_ns == 1'000'000'000);
  CHECK(c.to_ns == 1'500'000'000);
  CHECK(c.position.line == 29);
  c = condition("port: base.odometry, field: speed_m_s, at_least: 20cm/s, at_most: 1m/s, holds: once");
  CHECK(c.of == ConditionSpec::Of::field);
  CHECK(c.bound.at_least == 0.2);
  CHECK(c.bound.at_most == 1);
  CHECK(c.unit == "m/s");
  CHECK(c.holds == Holds::once);
  c = condition("port: ego_motion.motion, field: valid, is: 1, holds: always");
  CHECK(c.bound.at_least == 1);
  CHECK(c.bound.at_most == 1);
  CHECK(c.unit.empty());
  CHECK(condition("port: stereo.disparity, field: disparity, at_least: 1").field == "disparity");
  CHECK(condition("port: stereo.disparity, field: \"disparity[12]\", at_least: 1").field == "disparity[12]");
  CHECK(condition("port: stereo.disparity, messages: {at_most: 0}").bound.at_most == 0);
}

TEST_CASE("conditions on the world: attributes and distances") {
  ConditionSpec c = condition("world: cup_1.content, is: full, holds: never");
  CHECK(c.of == ConditionSpec::Of::attribute);
  CHECK(c.object == "cup_1");
  CHECK(c.attribute == "content");
  CHECK(c.is == "full");
  CHECK(c.holds == Holds::never);
  CHECK(condition("world: ace.blocked, is: true").is == "true");
  c = condition("world: ace, within: 50cm, of: [3m, -4m]");
  CHECK(c.of == ConditionSpec::Of::distance);
  CHECK(c.bound.at_most == 0.5);
  CHECK(c.x_m == 3);
  CHECK(c.y_m == -4);
  CHECK(c.other.empty());
  CHECK(condition("world: ace, within: 1m, of: bernd").other == "bernd");
  c = condition(
      "world: ace.terrain, contains: street, holds: never, unless: {port: base.odometry, field: speed_m_s, at_most: "
      "0m/s}");
  REQUIRE(c.unless.size() == 1);
  CHECK(c.unless[0].port.text() == "base.odometry");
  CHECK(c.unless[0].bound.at_most == 0);
}

TEST_CASE("figures, as a fault scenario has them") {
  const ExpectSpec expect = sound(graph_with("", R"(  modes: [full, blind, safe_stop]
  rates: {stereo: 14}
  misses: {stereo: 0, camera: {at_least: 1}}
  ages: {reaction: 300ms}
)"));
  CHECK(expect.within_ns == 30'000'000'000);
  CHECK(expect.conditions.empty());
  CHECK(expect.figures.modes.size() == 3);
  CHECK(expect.figures.rates.at("stereo").at_least == 14);
  CHECK(expect.figures.misses.at("stereo").at_most == 0);
  CHECK(expect.figures.misses.at("camera").at_least == 1);
  CHECK(expect.figures.ages.at("reaction").at_most == 300e6);
  const std::string text = graph_with("", "  rates: {sterio: 14}\n");
  expect_at(Files(text).load(), "graph.yaml", text, "sterio", {"`rates` names `sterio`", "did you mean `stereo`?"});
}

TEST_CASE("ports, fields and keys that there are not") {
  wrong("port: sterio.disparity, messages: 1", "sterio", {"no node or device `sterio`", "did you mean `stereo`?"});
  wrong("port: stereo.disparty, messages: 1", "stereo.disparty", {"no output", "did you mean `disparity`?"});
  wrong("port: base.odometry, field: sped_m_s, is: 1m/s", "sped_m_s", {"did you mean `speed_m_s`?"});
  wrong("port: base.odometry, at_least: 1m/s", "base.odometry", {"must be said as `field`", "speed_m_s"});
  wrong("port: base.odometry, field: speed_m_s, at_lest: 1m/s", "at_lest", {"unknown key", "did you mean `at_least`?"});
  wrong("port: base.odometry, field: speed_m_s, at_least: 1m/s, of: ace", "of:", {"takes no `of`"});
  wrong("port: base.odometry, messages: 1, holds: once", "holds", {"number of messages takes no `holds`"});
  wrong("port: base.odometry, field: speed_m_s, at_least: 1m/s, holds: often", "often", {"valid are: always"});
}

TEST_CASE("tests that do not fit, or lack a unit") {
  wrong("port: base.odometry, field: speed_m_s, at_least: 1", "1}", {"`at_least` of `speed_m_s`", "without a unit"});
  wrong("port: base.odometry, field: speed_m_s, contains: fast", "{port", {"is a number", "at_least"});
  wrong("port: base.odometry, field: speed_m_s", "{port", {"is a number", "at_least"});
  wrong("world: cup.content, is: full, contains: f", "{world", {"either `is` or `contains`"});
  wrong("world: cup.content, at_least: 1", "at_least", {"an attribute takes no `at_least`"});
  wrong("world: cup", "{world", {"within: 0.5m, of: [3m, 4m]"});
  wrong("world: cup, within: 1, of: [3m, 4m]", "1,", {"`within`", "without a unit"});
  wrong("world: cup, within: 1m, of: [3m, 4m, 5m]", "[3m", {"two lengths"});
  wrong("world: cup.content, is: full, unless: {world: ace.blocked, is: true}", "{world: ace", {"a test of a `field`"});
  wrong("world: cup.content, is: full, unless: {port: base.odometry, messages: 1}", "{port", {"a test of a `field`"});
  wrong("world: cup.content, is: full, unless: {port: base.odometri, is: 1}", "base.odometri",
        {"did you mean `odometry`?"});
  wrong("port: base.odometry, messages: 1, unless: {port: base.odometry, messages: 1}", "unless",
        {"takes no `unless`"});
  wrong("holds: once", "{holds", {"either on a `port` or on the simulated `world`"});
  wrong("port: base.odometry, messages: 1, from: 2s, to: 1s", "1s}", {"not after `from`"});
  wrong("port: base.odometry, messages: 1, from: 2", "2}", {"`from`", "without a unit"});
}

TEST_CASE("`within` is needed and above 0; the list is one") {
  const std::string none = kGraph + "expect: {misses: {stereo: 0}}\n";
  expect_at(Files(none).load(), "graph.yaml", none, "expect:", {"lacks `within`"});
  const std::string zero = kGraph + "expect: {within: 0s}\n";
  expect_at(Files(zero).load(), "graph.yaml", zero, "0s}", {"above 0"});
  const std::string empty = kGraph + "expect: {within: 1s, all: []}\n";
  expect_at(Files(empty).load(), "graph.yaml", empty, "[]}", {"`all`", "0 entries"});
}
