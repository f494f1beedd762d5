// SPDX-License-Identifier: Apache-2.0
#include "nodes/semantic/reports.hpp"

#include <doctest/doctest.h>

#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "rt/msg/ace/object_reports.hpp"
#include "rt/testing.hpp"
#include "tests/unit/semantic/report_message.hpp"

using namespace takt;
using namespace takt::semantic;

namespace {

struct Kitchen {
  SemanticMap map{{{50, 200}, 0.3, 40, 40, 0, 0}};
  NodeId level = *map.add_attribute("level", {ValueKind::enumerated, "", 0, 1, {"empty", "full"}, false});
  NodeId mass = *map.add_attribute("mass", {ValueKind::scalar, "kg", 0, 20, {}, false});
  NodeId colour = *map.add_attribute("colour", {ValueKind::colour, "", 0, 1, {}, false});
  NodeId cup = *map.add_type("cup");
  ReportReader reader{map};

  Kitchen() { REQUIRE(map.add_to_type(cup, level)); }
  struct Understood {
    std::optional<Observation> observation;
    std::vector<std::string> left_out;
  };
  Understood read(const ObjectReports& message, const mapping_3d::Affine& to_map = {}) {
    Understood last;
    for_each_report(message, [&](const Report& report) {
      last = {};
      uint64_t count = 0;
      last.observation = reader.read(report, to_map, 7, [&](Misfit misfit, const ObjectAttribute* attribute) {
        char text[200];
        last.left_out.emplace_back(explain(report, misfit, attribute, ++count, text));
      });
    });
    return last;
  }
};

}  // namespace

TEST_CASE("a report is understood as far as the network reaches, and what is left out is told") {
  Kitchen kitchen;
  test::Box<ObjectReports> message({0, 0, 1, 4});
  test::add_report(*message, "", "cup", 1, 2,
                   {{"level", "full"}, {"mass", "0.4kg"}, {"handle", "left"}, {"colour", "2 0 0"}});
  const auto shifted = mapping_3d::to_affine({10, 20, 0, 1, 0, 0, 0});
  const auto understood = kitchen.read(*message, shifted);
  REQUIRE(understood.observation);
  CHECK(understood.observation->type == kitchen.cup);
  CHECK(understood.observation->x_m == doctest::Approx(11));
  CHECK(understood.observation->y_m == doctest::Approx(22));
  CHECK(understood.observation->stamp_ns == 7);
  REQUIRE(understood.observation->states.size() == 2);
  CHECK(understood.observation->states[0].value == Value{Word{1}});
  CHECK(understood.observation->states[1].value == Value{0.4});
  CHECK(understood.left_out ==
        std::vector<std::string>{"left out handle of a cup, no attribute of the network: 1 such so far",
                                 "left out colour of a cup, `2 0 0` is no value of it: 2 such so far"});
}

TEST_CASE("a type that the network lacks, and a place that is no number, are no observations") {
  Kitchen kitchen;
  test::Box<ObjectReports> message({0, 0, 1, 4});
  test::add_report(*message, "", "fork", 1, 2);
  CHECK(kitchen.read(*message).left_out ==
        std::vector<std::string>{"left out a `fork`, no type of the network: 1 such so far"});
  CHECK_FALSE(kitchen.read(*message).observation);
  test::add_report(*message, "", "level", 1, 2);  // a node, but no type
  CHECK_FALSE(kitchen.read(*message).observation);
  test::add_report(*message, "", "cup", std::numeric_limits<float>::infinity(), 2);
  CHECK(kitchen.read(*message).left_out == std::vector<std::string>{"left out a cup, nowhere: 1 such so far"});
}

TEST_CASE("a message that promises more than it holds is read as far as it goes") {
  test::Box<ObjectReports> message({0, 0, 1, 4});
  test::add_report(*message, "a", "cup", 1, 2, {{"level", "full"}});
  test::add_report(*message, "b", "cup", 3, 4, {{"level", "empty"}});
  message->places[0].attributes = -3;
  message->places[1].attributes = 1e9F;
  std::memset(message->names[1].type, 'x', sizeof(ObjectName::type));  // not ended
  std::vector<std::pair<std::string, size_t>> seen;
  const auto read = [&] {
    seen.clear();
    for_each_report(*message, [&](const Report& report) { seen.emplace_back(report.type, report.attributes.size()); });
  };
  read();
  CHECK(seen == decltype(seen){{"cup", 0}, {std::string(32, 'x'), 2}});
  message->places[0].attributes = std::numeric_limits<float>::quiet_NaN();
  message->places.resize(1);
  read();
  CHECK(seen == decltype(seen){{"cup", 0}});
}

TEST_CASE("what the map holds comes back from its reports: names, types, places and values") {
  Kitchen kitchen;
  const NodeId one = *kitchen.map.add_object(kitchen.cup, 1, 2),
               two = *kitchen.map.add_object(kitchen.cup, 3, 4, "mine");
  REQUIRE(kitchen.map.set_state(one, kitchen.level, Word{1}));
  REQUIRE(kitchen.map.set_state(one, kitchen.mass, 0.25));
  REQUIRE(kitchen.map.set_state(two, kitchen.colour, Rgb{0.5F, 0.25F, 1}));
  kitchen.map.object(one).confidence = 0.75;
  test::Box<ObjectReports> message({0, 0, 1, 4});
  write_reports(kitchen.map, *message);
  CHECK(message->in_map == 1);
  Kitchen other;
  for_each_report(*message, [&](const Report& report) {
    const auto said = other.reader.read(report, {}, 0, [](Misfit, const ObjectAttribute*) { FAIL("left out"); });
    REQUIRE(said);
    const NodeId node = *other.map.add_object(said->type, said->x_m, said->y_m, said->name);
    other.map.object(node).confidence = said->confidence;
    for (const State& state : said->states) REQUIRE(other.map.set_state(node, state.attribute, state.value));
  });
  const NodeId again = other.map.network().find("cup_1"), mine = other.map.network().find("mine");
  REQUIRE(again != kNoNode);
  REQUIRE(mine != kNoNode);
  CHECK(other.map.object(again).x_m == 1);
  CHECK(other.map.object(again).confidence == 0.75);
  CHECK(other.map.state(again, other.level) == Value{Word{1}});
  CHECK(other.map.state(again, other.mass) == Value{0.25});
  CHECK(other.map.state(mine, other.colour) == Value{Rgb{0.5F, 0.25F, 1}});
}

TEST_CASE("more objects than a message has room for: those that fit, each with its attributes") {
  Kitchen kitchen;
  for (int i = 0; i < 6; ++i)
    REQUIRE(kitchen.map.set_state(*kitchen.map.add_object(kitchen.cup, 1, 1), kitchen.level, Word{0}));
  test::Box<ObjectReports> message({0, 0, 1, 4});
  write_reports(kitchen.map, *message);
  CHECK(message->names.size == 4);
  CHECK(message->places.size == 4);
  CHECK(message->attributes.size == 4);
}
