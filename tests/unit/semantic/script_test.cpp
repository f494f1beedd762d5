// SPDX-License-Identifier: Apache-2.0
#include "nodes/semantic/script.hpp"

#include <doctest/doctest.h>

#include "nodes/semantic/clock_generator.hpp"
#include "rt/msg/requests.hpp"
#include "tests/nanoseconds.hpp"

using namespace takt;
using namespace takt::semantic;
using test::kSecond;

namespace {

/// "a off, b/2" for what deviates.
std::string text(const ClockGenerator& generator) {
  std::string all;
  for (const Request& r : generator.deviating())
    all += (all.empty() ? "" : ", ") + std::string(r.node) + (r.run ? "/" + std::to_string(r.every) : " off");
  return all;
}

}  // namespace

TEST_CASE("a script is read in any order, with blanks and an empty end") {
  const auto script = parse_script(" 10s pace ground_map 2;5s stop object_detection ;\n500ms start a1; ");
  REQUIRE(script.has_value());
  REQUIRE(script->size() == 3);
  CHECK((*script)[0].after_ns == kSecond / 2);
  CHECK((*script)[0].verb == Verb::start);
  CHECK((*script)[0].node == "a1");
  CHECK((*script)[1].after_ns == 5 * kSecond);
  CHECK((*script)[1].verb == Verb::stop);
  CHECK((*script)[2].verb == Verb::pace);
  CHECK((*script)[2].node == "ground_map");
  CHECK((*script)[2].every == 2);
  CHECK(parse_script("")->empty());
  CHECK(parse_script(" ; ;")->empty());
  CHECK((*parse_script("1.25s stop a"))[0].after_ns == 1'250'000'000);
}

TEST_CASE("a mistake in a script is quoted, with the valid forms") {
  struct Mistake {
    const char *script, *piece, *why;
  };
  for (const Mistake& m : std::initializer_list<Mistake>{
           {"1s stop a; 2s halt b", "\"2s halt b\"", "`halt` is no request"},
           {"5 stop a", "\"5 stop a\"", "`5` is no time"},
           {"-5s stop a", "\"-5s stop a\"", "no time"},
           {"nans stop a", "\"nans stop a\"", "no time"},
           {"5m stop a", "\"5m stop a\"", "no time"},
           {"stop a", "\"stop a\"", "`stop` is no time"},
           {"5s", "\"5s\"", "nothing is asked for"},
           {"5s stop", "\"5s stop\"", "2 words instead of 3"},
           {"5s stop a b", "\"5s stop a b\"", "4 words instead of 3"},
           {"5s pace a", "\"5s pace a\"", "3 words instead of 4"},
           {"5s pace a 0", "\"5s pace a 0\"", "`0` is no N of 1..255"},
           {"5s pace a 256", "\"5s pace a 256\"", "no N"},
           {"5s pace a 2x", "\"5s pace a 2x\"", "no N"},
           {"5s stop A", "\"5s stop A\"", "`A` is no node id"},
           {"5s stop abcdefghijklmnopqrstuvwxyz0123", "abcdefghijklmnopqrstuvwxyz0123", "longer than the 29"}}) {
    CAPTURE(m.script);
    const auto read = parse_script(m.script);
    REQUIRE_FALSE(read.has_value());
    CHECK_MESSAGE(read.error().find(m.piece) != std::string::npos, read.error());
    CHECK_MESSAGE(read.error().find(m.why) != std::string::npos, read.error());
    CHECK(read.error().find("\"TIME pace NODE N\"") != std::string::npos);
  }
  CHECK(parse_script("5s stop abcdefghijklmnopqrstuvwxyz012").has_value());
}

TEST_CASE("a list of nodes") {
  CHECK(*parse_node_list(" a, b,c  a") == std::vector<std::string>{"a", "b", "c"});
  CHECK(parse_node_list("")->empty());
  CHECK(parse_node_list("a, B").error().find("`B` is no node id") != std::string::npos);
}

TEST_CASE("the clock generator names who deviates, and nobody else") {
  ClockGenerator generator(
      *parse_script("1s stop a; 2s pace b 3; 3s start a; 4s pace a 2; 5s stop a; 6s start a; 7s pace a 1; 7s pace b 1"),
      {}, 1);
  CHECK(generator.nodes() == 2);
  const auto at = [&](int64_t ns) {
    generator.update(ns, false);
    return text(generator);
  };
  CHECK(at(0) == "");
  CHECK(at(kSecond - 1) == "");
  CHECK(at(kSecond) == "a off");
  CHECK(at(2 * kSecond) == "a off, b/3");
  CHECK(at(3 * kSecond) == "b/3");
  CHECK(at(4 * kSecond) == "a/2, b/3");
  CHECK(at(5 * kSecond) == "a off, b/3");
  CHECK(at(6 * kSecond) == "a/2, b/3");  // a stop does not forget the pace
  CHECK(at(60 * kSecond) == "");
}

TEST_CASE("idle nodes are paced while the robot is stopped; a slower pace of the script stays") {
  ClockGenerator generator(*parse_script("1s pace a 5; 1s pace b 2; 1s stop c"), {"c", "b", "a", "d"}, 3);
  generator.update(0, false);
  CHECK(text(generator) == "");
  generator.update(1, true);
  CHECK(text(generator) == "a/3, b/3, c/3, d/3");
  generator.update(kSecond, true);
  CHECK(text(generator) == "a/5, b/3, c off, d/3");
  generator.update(kSecond, false);
  CHECK(text(generator) == "a/5, b/2, c off");
}

TEST_CASE("nodes on request are stopped until the script starts them, or while they are asked for") {
  ClockGenerator generator(*parse_script("2s start fusion; 3s stop fusion"), {"a"}, 2, {}, {"fusion", "fusion_2"});
  const auto at = [&](int64_t ns, std::string_view ids) {
    generator.request(ids);
    generator.update(ns, false);
    return text(generator);
  };
  CHECK(at(0, "") == "fusion off, fusion_2 off");
  CHECK(at(1, "fusion") == "fusion_2 off");
  CHECK(at(2, "other, fusion_2 fusion") == "");
  CHECK(at(3, "fusion_") == "fusion off, fusion_2 off");
  CHECK(at(4, ",") == "fusion off, fusion_2 off");
  CHECK(at(2 * kSecond, "") == "fusion_2 off");
  CHECK(at(3 * kSecond, "fusion_2") == "fusion off");
  CHECK(at(4 * kSecond, "fusion,fusion_2") == "");
}

TEST_CASE("rules: a node, what it is needed for, and what is asked of it otherwise") {
  const auto rules = parse_rules(
      "body_pose when person within 4m else stop;\n signs when crossing else pace 3; a when cup within 50cm else pace "
      "255;");
  REQUIRE(rules.has_value());
  REQUIRE(rules->size() == 3);
  CHECK((*rules)[0].otherwise.node == std::string_view("body_pose"));
  CHECK((*rules)[0].type == "person");
  CHECK((*rules)[0].within_m == 4);
  CHECK((*rules)[0].otherwise.run == 0);
  CHECK((*rules)[1].type.empty());
  CHECK((*rules)[1].otherwise.run == 1);
  CHECK((*rules)[1].otherwise.every == 3);
  CHECK((*rules)[2].within_m == 0.5);
  CHECK((*rules)[2].otherwise.every == 255);
  CHECK(parse_rules(" ; ")->empty());
}

TEST_CASE("a mistake in a rule is quoted, with the valid forms") {
  struct Mistake {
    const char *rules, *piece, *why;
  };
  for (const Mistake& m : std::initializer_list<Mistake>{
           {"a when crossing else stop; B when crossing else stop", "\"B when crossing else stop\"",
            "`B` is no node id"},
           {"a", "\"a\"", "lacks `when` and a condition"},
           {"a if crossing else stop", "\"a if crossing else stop\"", "lacks `when`"},
           {"a when raining else stop", "\"a when raining else stop\"", "`raining` is no condition"},
           {"a when cup within 4 else stop", "\"a when cup within 4 else stop\"", "`4` is no length"},
           {"a when cup within -4m else stop", "\"a when cup within -4m else stop\"", "`-4m` is no length"},
           {"a when crossing", "\"a when crossing\"", "lacks `else`"},
           {"a when crossing else", "\"a when crossing else\"", "lacks `else`"},
           {"a when crossing else halt", "\"a when crossing else halt\"", "no request"},
           {"a when crossing else stop now", "\"a when crossing else stop now\"", "no request"},
           {"a when crossing else pace", "\"a when crossing else pace\"", "no request"},
           {"a when crossing else pace 1", "\"a when crossing else pace 1\"", "`1` is no N of 2..255"},
           {"a when crossing else pace 256", "\"a when crossing else pace 256\"", "`256` is no N of 2..255"}}) {
    CAPTURE(m.rules);
    const auto rules = parse_rules(m.rules);
    REQUIRE_FALSE(rules.has_value());
    CHECK(rules.error().starts_with(m.piece));
    CHECK(rules.error().find(m.why) != std::string::npos);
    CHECK(rules.error().find("NODE when CONDITION else pace N") != std::string::npos);
  }
}

TEST_CASE("a node is needed from the first instant on, some way beyond the distance, and a while longer") {
  const auto rules = parse_rules("a when cup within 4m else stop");
  ClockGenerator generator({}, {}, 1, Needs(*rules, {0.5, 2 * kSecond}));
  const auto at = [&](double s, std::optional<double> cup_m) {
    std::vector<Neighbour> near{{"table", 0.1}};
    if (cup_m) near.push_back({"cup", *cup_m});
    Surroundings around;
    around.objects = near;
    generator.update(static_cast<int64_t>(s * 1e9), false, around);
    return text(generator);
  };
  generator.update(0, false);
  CHECK(text(generator) == "");  // nobody tells of anything yet
  CHECK(at(1, {}) == "");
  CHECK(at(2.5, {}) == "a off");
  CHECK(at(3, 4.2) == "a off");
  CHECK(at(4, 3.9) == "");
  CHECK(at(5, 4.4) == "");  // it was near
  CHECK(at(6, 4.6) == "");
  CHECK(at(7, 4.6) == "");
  CHECK(at(7.5, 4.6) == "a off");
  CHECK(at(8, 4.4) == "a off");
}

TEST_CASE("of script, idle list and rules the least counts") {
  const auto rules =
      parse_rules("a when crossing else pace 3; b when crossing else stop; a when cup within 1m else pace 4");
  const auto script = parse_script("0s pace a 2; 0s pace b 7; 5s stop a");
  ClockGenerator generator(*script, {"a"}, 5, Needs(*rules, {0, 0}));
  Surroundings around;
  around.crossing = true;
  generator.update(0, false, around);
  CHECK(text(generator) == "a/2, b/7");
  around.crossing = false;
  generator.update(kSecond, false, around);
  CHECK(text(generator) == "a/3, b off");
  around.objects.emplace();
  generator.update(2 * kSecond, false, around);
  CHECK(text(generator) == "a/4, b off");
  generator.update(3 * kSecond, true, around);
  CHECK(text(generator) == "a/5, b off");
  around.crossing = true;
  generator.update(6 * kSecond, false, around);
  CHECK(text(generator) == "a off, b/7");
}
