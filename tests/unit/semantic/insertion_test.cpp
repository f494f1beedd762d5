// SPDX-License-Identifier: Apache-2.0
#include "nodes/semantic/insertion.hpp"

#include <doctest/doctest.h>

#include <string>
#include <vector>

#include "rt/memory/memory_use.hpp"

using namespace takt;
using namespace takt::semantic;

namespace {

constexpr Rgb kRed{1, 0, 0}, kYellow{1, 1, 0};

struct InsertionFixture {
  SemanticMap map{MapParameters{{200, 600}, 0.3, 100, 100, -15, -15}};
  NodeId colour = *map.add_attribute("colour", {ValueKind::colour, "", 0, 1, {}, false});
  NodeId chair = *map.add_type("chair"), table = *map.add_type("table");
  InsertionParameters parameters;
  int64_t stamp_ns = 0;

  InsertionFixture() {
    REQUIRE(map.add_to_type(chair, colour));
    REQUIRE(map.add_to_type(table, colour));
  }
  NodeId add(NodeId type, double x_m, const Value& value) {
    const NodeId object = *map.add_object(type, x_m, 0);
    REQUIRE(map.set_state(object, colour, value));
    return object;
  }
  double p(NodeId a, NodeId b) { return Similarity(map, parameters.similarity).compare(a, b).p; }
  Decision insert(Insertion& insertion, double x_m, const Value& value = {}) {
    const State state{colour, value};
    return insertion.insert({chair, x_m, 0, 0.9, stamp_ns += 1000, {&state, 1}});
  }
  std::string why(const Decision& decision) const {
    char text[kLongestReason];
    return std::string(explain(map, decision, parameters, text));
  }
  size_t objects() const { return map.all(Kind::object).size(); }
};

}  // namespace

TEST_CASE("oracle 24: similarity of two objects") {
  InsertionFixture f;
  const NodeId red = f.add(f.chair, 0, kRed);
  CHECK(f.p(red, f.add(f.chair, 0, kRed)) == 1);
  CHECK(f.p(red, f.add(f.table, 0, kRed)) == 0);
  CHECK(f.p(red, f.add(f.chair, 2, kRed)) == 0.5);
  CHECK(f.p(red, f.add(f.chair, 3, kRed)) == 0.5);
  CHECK(f.p(red, f.add(f.chair, 0, kYellow)) == doctest::Approx(0.711).epsilon(0.001));
  CHECK(f.p(red, f.add(f.chair, 1, kYellow)) == doctest::Approx(0.586).epsilon(0.001));
  CHECK(f.p(red, f.add(f.chair, 1, kRed)) == doctest::Approx(0.875));
  CHECK(f.p(red, f.add(f.chair, std::sqrt(2.0), kRed)) == doctest::Approx(0.75));
}

TEST_CASE("an unknown value is left out, an attribute that one of the two cannot have counts 1") {
  InsertionFixture f;
  const NodeId mass = *f.map.add_attribute("mass", {ValueKind::scalar, "kg", 0, 10, {}, false});
  const NodeId red = f.add(f.chair, 0, kRed), unknown = *f.map.add_object(f.chair, 0, 0);
  CHECK(f.p(red, unknown) == 1);
  const NodeId heavy = f.add(f.chair, 0, kRed);
  REQUIRE(f.map.set_state(heavy, mass, 5.0));
  CHECK(f.map.network().connected(heavy, mass));
  CHECK(f.p(red, heavy) == 0.75);  // colour 0, mass 1, equal weights
  const NodeId light = f.add(f.chair, 0, kRed);
  REQUIRE(f.map.set_state(light, mass, 3.0));
  CHECK(f.p(light, heavy) == doctest::Approx(0.95));
}

TEST_CASE("weights are those of the type; identity cannot differ") {
  InsertionFixture f;
  const NodeId name = *f.map.add_attribute("name", {ValueKind::enumerated, "", 0, 1, {"Ann", "Bob"}, true});
  const NodeId person = *f.map.add_type("person");
  REQUIRE(f.map.add_to_type(person, f.colour, 3));
  REQUIRE(f.map.add_to_type(person, name, 1));
  const NodeId a = *f.map.add_object(person, 0, 0), b = *f.map.add_object(person, 0, 0);
  REQUIRE(f.map.set_state(a, f.colour, kRed));
  REQUIRE(f.map.set_state(b, f.colour, kYellow));
  REQUIRE(f.map.set_state(a, name, Word{0}));
  REQUIRE(f.map.set_state(b, name, Word{0}));
  CHECK(f.p(a, b) == doctest::Approx(1 - 0.75 * std::sqrt(1.0 / 3) / 2));
  REQUIRE(f.map.set_state(b, name, Word{1}));
  CHECK(f.p(a, b) == 0);
}

TEST_CASE("distances of every kind of value lie in 0..1") {
  const Attribute scalar{ValueKind::scalar, "m", -1, 3, {}, false}, boolean{},
      colour{ValueKind::colour, "", 0, 1, {}, false}, word{ValueKind::enumerated, "", 0, 1, {"a", "b", "c"}, false};
  CHECK(distance(scalar, -1.0, 3.0) == 1);
  CHECK(distance(scalar, 0.0, 1.0) == 0.25);
  CHECK(distance(boolean, true, true) == 0);
  CHECK(distance(boolean, true, false) == 1);
  CHECK(distance(colour, Rgb{0, 0, 0}, Rgb{1, 1, 1}) == 1);
  CHECK(distance(word, Word{0}, Word{2}) == 1);
  CHECK(distance(word, Word{2}, Word{2}) == 0);
  CHECK_FALSE(fits(scalar, 3.5));
  CHECK_FALSE(fits(scalar, true));
  CHECK_FALSE(fits(word, Word{3}));
  CHECK_FALSE(fits(colour, Rgb{0, 0, 1.5F}));
}

TEST_CASE("oracle 26: two detections 0.5 m apart are one object, three chairs 2.5 m apart stay three") {
  InsertionFixture f;
  Insertion insertion(f.map, f.parameters);
  const Decision first = f.insert(insertion, 0), second = f.insert(insertion, 0.5);
  CHECK(first.outcome == Outcome::created);
  CHECK(second.outcome == Outcome::merged);
  CHECK(second.object == first.object);
  CHECK(f.map.object(first.object).x_m == 0.25);
  CHECK(f.why(second) == "merged with chair_1, p = 0.97 >= 0.75: 0.50 m apart");
  CHECK(f.insert(insertion, 2.75).outcome == Outcome::created);
  CHECK(f.insert(insertion, 5.25).outcome == Outcome::created);
  CHECK(f.objects() == 3);
}

TEST_CASE("colours keep two objects of one place apart, and the decision says why") {
  InsertionFixture f;
  Insertion insertion(f.map, f.parameters);
  f.insert(insertion, 0, kRed);
  const Decision d = f.insert(insertion, 0, kYellow);
  CHECK(f.why(d) == "created chair_2: most similar is chair_1, p = 0.71 < 0.75: 0.00 m apart, colour differs by 0.58");
  CHECK(f.why(f.insert(insertion, 8)) == "created chair_3: none of its type within 2 m");
  const Decision outside = f.insert(insertion, 100);
  CHECK(outside.outcome == Outcome::refused);
  CHECK(f.why(outside) == "refused a chair: lies outside of the map");
}

TEST_CASE("objects of one view are two if that is asked for") {
  InsertionFixture f;
  f.parameters.distinct_in_view = true;
  Insertion insertion(f.map, f.parameters);
  CHECK(insertion.insert({f.chair, 0, 0, 1, 5, {}}).outcome == Outcome::created);
  CHECK(insertion.insert({f.chair, 0.3, 0, 1, 5, {}}).outcome == Outcome::created);
  const Decision next = insertion.insert({f.chair, 0.31, 0, 1, 6, {}});
  CHECK(next.outcome == Outcome::merged);
  CHECK(next.name == std::string_view("chair_2"));
}

TEST_CASE("cells and objects are linked both ways, as objects move") {
  InsertionFixture f;
  const auto at = [&](double x_m) {
    std::vector<NodeId> objects;
    f.map.in_cell(f.map.grid().cell_of(x_m, 0), [&](NodeId o) { objects.push_back(o); });
    return objects;
  };
  const NodeId a = *f.map.add_object(f.chair, 0.1, 0), b = *f.map.add_object(f.chair, 0.2, 0);
  CHECK(at(0.1) == std::vector{b, a});
  REQUIRE(f.map.move(b, 0.4, 0));
  CHECK(at(0.1) == std::vector{a});
  CHECK(at(0.4) == std::vector{b});
  CHECK_FALSE(f.map.move(b, 15.1, 0));
  f.map.remove(b);
  CHECK(at(0.4).empty());
  std::vector<NodeId> near;
  f.map.near(0, 0, 0.11, [&](NodeId o, double) { near.push_back(o); });
  CHECK(near == std::vector{a});
}

TEST_CASE("terrain is kept at the place where it was seen; known cells of another grid are taken over") {
  InsertionFixture f;
  f.map.set_terrain(1, 1, 3);
  f.map.set_terrain(99, 1, 3);
  CHECK(f.map.terrain(1.1, 1.1) == 3);
  CHECK(f.map.terrain(2, 1) == 0);
  CHECK(f.map.terrain(99, 1) == 0);
  const std::vector<int16_t> cells{0, 1000, -1, 700};
  f.map.take_over({{cells.data(), 2, 2}, 0.6, 0, 0});
  const auto at = [&](double x_m, double y_m) {
    const navigation::Cell cell = f.map.grid().cell_of(x_m, y_m);
    return f.map.grid().cells.at(cell.column, cell.row);
  };
  CHECK(at(0.1, 0.5) == 0);
  CHECK(at(0.7, 0.1) == 1000);
  CHECK(at(1.1, 1.1) == 700);
  CHECK(at(0.1, 0.7) == -1);
  CHECK(at(1.3, 0.1) == -1);
}

TEST_CASE(
    "an object whose place is seen free often enough is removed; one that is seen, hidden or out of sight stays") {
  InsertionFixture f;
  f.parameters.misses = 3;
  Insertion insertion(f.map, f.parameters);
  std::vector<int16_t> cells(100 * 100, 0);
  const navigation::OccupancyView seen{{cells.data(), 100, 100}, 0.3, -15, -15};
  const NodeId gone = f.insert(insertion, 2).object;
  f.insert(insertion, 4.5);                        // chair_2: something stands there
  insertion.insert({f.chair, -2, 0, 1, 1, {}});    // chair_3: behind the robot
  insertion.insert({f.chair, 3, -1.5, 1, 1, {}});  // chair_4: its place is not known
  insertion.insert({f.chair, 3, 1.5, 1, 1, {}});   // chair_5: seen again
  const auto mark = [&](double x_m, double y_m, int16_t value) {
    const navigation::Cell cell = seen.cell_of(x_m, y_m);
    cells[static_cast<size_t>(cell.row * 100 + cell.column)] = value;
  };
  mark(4.5, 0, 900);
  mark(3, -1.5, -1);
  std::vector<std::string> told;
  for (int64_t stamp = 100'000; stamp < 100'004; ++stamp) {
    insertion.insert({f.chair, 3, 1.5, 1, stamp, {}});
    insertion.forget({0, 0, 0, 0.576, 5, stamp}, seen, [&](const Decision& d) { told.push_back(f.why(d)); });
  }
  CHECK(told ==
        std::vector<std::string>{"removed chair_1: its place was seen free 3 times in a row, after 1 sightings"});
  CHECK_FALSE(f.map.network().exists(gone));
  CHECK(f.objects() == 4);
  const Decision later = insertion.insert({f.chair, -8, 0, 1, 5, {}});
  CHECK(later.name == std::string_view("chair_6"));  // a name never comes back
}

TEST_CASE("insertions and removals take no memory") {
  InsertionFixture f;
  f.parameters.misses = 1;
  Insertion insertion(f.map, f.parameters);
  const std::vector<int16_t> cells(100 * 100, 0);
  const navigation::OccupancyView seen{{cells.data(), 100, 100}, 0.3, -15, -15};
  const NodeId unforeseen = *f.map.type_named("lamp");
  const uint64_t before = thread_memory_use().allocations;
  size_t removed = 0;
  for (int i = 0; i < 500; ++i) {
    f.insert(insertion, 0.02 * (i % 700), i % 3 == 0 ? Value{kRed} : Value{});
    insertion.insert({unforeseen, 0, 0.02 * (i % 300), 1, f.stamp_ns, {}});
    insertion.forget({0, 0, 0, 3, 10, f.stamp_ns + 1}, seen, [&](const Decision&) { ++removed; });
  }
  if (counting_allocations()) CHECK(thread_memory_use().allocations == before);
  CHECK(removed == 1000);
}

TEST_CASE("what has a name is the object of that name, however near and like another one it is") {
  InsertionFixture f;
  Insertion insertion(f.map, f.parameters);
  const auto named = [&](const char* name, double x_m) {
    Observation seen{f.chair, x_m, 0, 0.9, f.stamp_ns += 1000, {}, {}};
    seen.name = name;
    return f.why(insertion.insert(seen));
  };
  CHECK(named("hers", 1) == "created hers: nothing had its name");
  CHECK(named("his", 1) == "created his: nothing had its name");
  CHECK(named("hers", 2) == "merged with hers, which has its name: 1.00 m apart");
  const NodeId hers = f.map.network().find("hers");
  CHECK(f.map.object(hers).x_m == 1.5);
  CHECK(named("hers", 5) == "merged with hers, which has its name: 3.50 m apart");
  CHECK(f.map.object(hers).x_m == 5);  // it was carried there
  CHECK(f.map.object(hers).sightings == 1);
  CHECK(f.objects() == 2);
  // A name that a type or an object of another type has is nobody's.
  CHECK(named("table", 1) == "refused a chair: " + std::string(to_string(NetworkError::name_taken)));
  REQUIRE(f.map.add_object(f.table, 0, 0, "desk"));
  CHECK(named("desk", 0) == "refused a chair: " + std::string(to_string(NetworkError::name_taken)));
}
