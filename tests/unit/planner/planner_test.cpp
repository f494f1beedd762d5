// SPDX-License-Identifier: Apache-2.0
#include "nodes/planner/planner.hpp"

#include <doctest/doctest.h>

#include "nodes/semantic/network_file.hpp"
#include "rt/memory/memory_use.hpp"
#include "tests/unit/planner/cup_and_bottles.hpp"

using namespace takt;
using namespace takt::planner;
using namespace takt::semantic;

namespace {

/// A network, and plans of its goals written "object.attribute=value".
struct Fixture {
  SemanticMap map{MapParameters{{100, 300}, 0.3, 100, 100, -15, -15}};
  DomainParameters parameters;
  ActionCosts costs;

  explicit Fixture(const std::string& network) {
    const auto read = parse_network(network, "n.yaml", map);
    REQUIRE_MESSAGE(read, read.error().front());
  }
  NodeId node(std::string_view name) const { return map.network().find(name); }
  Goal goal(std::string_view object, std::string_view attribute, std::string_view value) const {
    return {node(object), node(attribute), *parse_value(map.attribute(node(attribute)), value)};
  }
  Domain domain(const std::vector<Goal>& goals) const {
    const auto ground = planner::ground(map, goals, {0, 0}, parameters, costs);
    REQUIRE_MESSAGE(ground, ground.error());
    return *ground;
  }
  Plan plan(const std::vector<Goal>& goals, Method method = Method::best) const {
    return Planner({method, {}, {1000, 10'000}}).plan(domain(goals));
  }
  /// "open bottle_1; fill cup_1 bottle_1".
  std::string steps(const std::vector<Goal>& goals, Method method = Method::best) const {
    const Domain d = domain(goals);
    std::string text;
    for (const Step& step : plan(goals, method).steps) {
      text += (text.empty() ? "" : "; ") + std::string(map.network().name(d.actions[step.action].action));
      for (const NodeId object : d.actions[step.action].objects) text += " " + std::string(map.network().name(object));
    }
    return text;
  }
};

/// Thesis Eq. 5.23 to 5.26.
constexpr const char* kWorkedExample = R"(
takt_network: 1
attributes: {a5: {kind: enumerated, words: ["0", "1", "2"]}, a6: {kind: boolean}, a7: {kind: enumerated, words: ["0", "1"]}}
types: {t3: {attributes: [a5]}, t4: {attributes: [a5, a6]}}
actions:
  c8: {roles: {x: t3, y: t4}, cost: 2s, requires: {x.a5: "0", y.a5: "1"}, results: {x.a5: "1", y.a5: "2"}}
  c9: {roles: {y: t4}, cost: 1s, requires: {y.a5: "0"}, results: {y.a5: "1"}}
objects:
  o1: {type: t3, at: [1m, 0m], states: {a5: "0", a7: "0"}}
  o2: {type: t4, at: [2m, 0m], states: {a5: "0", a6: false}}
)";

/// Cup and bottles; the second, open one at `x_m`.
std::string cup_and_bottles(const std::string& x_m) {
  return test::cup_and_bottles("[1m, 0m]", "[2m, 0m]", "[" + x_m + "m, 0m]");
}

}  // namespace

TEST_CASE("oracle 25: the thesis's worked example") {
  for (const Method method : {Method::best, Method::recursive}) {
    Fixture f(kWorkedExample);
    CHECK(f.steps({f.goal("o1", "a5", "1"), f.goal("o1", "a7", "0")}, method) == "c9 o2; c8 o1 o2");
  }
}

TEST_CASE("oracle 25: cup and bottles switch with the distance") {
  for (const Method method : {Method::best, Method::recursive}) {
    // Opening takes 4 s and another 1 m each way of driving at 0.7 m/s.
    Fixture near(cup_and_bottles("4")), far(cup_and_bottles("9"));
    CHECK(near.steps({near.goal("cup_1", "level", "full")}, method) == "fill cup_1 bottle_2");
    CHECK(far.steps({far.goal("cup_1", "level", "full")}, method) == "open bottle_1; fill cup_1 bottle_1");
  }
}

TEST_CASE("oracle 25: nothing to do, no plan, and two actions that undo each other") {
  constexpr const char* kSwitch = R"(
takt_network: 1
attributes: {on: {kind: boolean}, broken: {kind: boolean}}
types: {lamp: {attributes: [on, broken]}}
actions:
  light: {roles: {l: lamp}, cost: 1s, requires: {l.on: false, l.broken: false}, results: {l.on: true}}
  douse: {roles: {l: lamp}, cost: 1s, requires: {l.on: true, l.broken: false}, results: {l.on: false}}
objects: {l1: {type: lamp, at: [1m, 0m], states: {on: false, broken: true}}}
)";
  for (const Method method : {Method::best, Method::recursive}) {
    Fixture f(kSwitch);
    const Plan nothing = f.plan({f.goal("l1", "on", "false")}, method);
    CHECK(nothing.cost_ns == 0);
    CHECK(nothing.steps.empty());
    const Plan impossible = f.plan({f.goal("l1", "on", "true")}, method);
    CHECK(impossible.cost_ns == -1);
    CHECK(impossible.verdict == (method == Method::best ? Verdict::none : Verdict::gave_up));
  }
}

TEST_CASE("a plan as text, with what each step costs") {
  Fixture f(cup_and_bottles("9"));
  const std::vector<Goal> goals{f.goal("cup_1", "level", "full")};
  CHECK(to_text(f.map, f.domain(goals), f.plan(goals)) ==
        "1. open(b bottle_1): drive 2.9 s, act 4.0 s\n"
        "2. fill(c cup_1, b bottle_1): drive 2.9 s, act 6.0 s\n"
        "15.7 s in all; no plan takes less");
}

TEST_CASE("costs as the thesis counts them: driving from the beginning to each object") {
  Fixture f(cup_and_bottles("9"));
  f.parameters.cost_mode = CostMode::faithful;
  const std::vector<Goal> goals{f.goal("cup_1", "level", "full")};
  // Open and fill: 4 + 2/0.7, 6 + (1 + 2)/0.7 = 17.14 s; the open bottle: 6 + (1 + 9)/0.7 = 20.29 s.
  CHECK(static_cast<double>(f.plan(goals).cost_ns) * 1e-9 == doctest::Approx(17.142857));
}

TEST_CASE("what actions take is learned from doing them, and changes the plan") {
  Fixture f(cup_and_bottles("9"));
  const std::vector<Goal> goals{f.goal("cup_1", "level", "full")};
  CHECK(f.steps(goals) == "open bottle_1; fill cup_1 bottle_1");
  const NodeId open = f.node("open");
  f.costs.learn(open, 4, 20);
  CHECK(f.costs.cost_s(open, 4) == 12);  // what was declared counts as one observation
  CHECK(f.steps(goals) == "fill cup_1 bottle_2");
  for (int i = 0; i < 100; ++i) f.costs.learn(open, 4, 2);
  CHECK(f.costs.cost_s(open, 4) == doctest::Approx(2).epsilon(0.01));
  CHECK(f.steps(goals) == "open bottle_1; fill cup_1 bottle_1");
}

TEST_CASE("ways that a path planner knows replace straight lines") {
  Fixture f(cup_and_bottles("4"));
  f.parameters.travel = [](const planner::Place& a, const planner::Place& b) {
    const bool wall = (a.x_m < 3) != (b.x_m < 3);  // between the cup and the open bottle
    return static_cast<int64_t>((std::abs(a.x_m - b.x_m) + (wall ? 20 : 0)) / 0.7 * 1e9);
  };
  CHECK(f.steps({f.goal("cup_1", "level", "full")}) == "open bottle_1; fill cup_1 bottle_1");
}

TEST_CASE("goals that cannot be meant are refused with what is valid") {
  Fixture f(cup_and_bottles("4"));
  const auto error = [&](const Goal& goal) {
    const auto ground = planner::ground(f.map, {&goal, 1}, {0, 0}, {});
    REQUIRE_FALSE(ground);
    return ground.error();
  };
  CHECK(error({f.node("cup_1"), f.node("closed"), true}) ==
        "cup_1 has no attribute that the goal names; valid are: level");
  CHECK(error({f.node("cup_1"), f.node("level"), true}) ==
        "level of cup_1 cannot have the goal's value; valid: empty, full");
  CHECK(error({f.node("cup"), f.node("level"), true}) == "a goal names no object");
  f.parameters.most_actions = 1;
  const Goal goal = f.goal("cup_1", "level", "full");
  CHECK(planner::ground(f.map, {&goal, 1}, {0, 0}, f.parameters).error() ==
        "the roles of actions can be filled in more than 1 ways; ask for less, or raise most_actions");
}

TEST_CASE("a search that ends early returns the plan it was given and what is proved") {
  Fixture f(cup_and_bottles("9"));
  const Domain domain = f.domain({f.goal("cup_1", "level", "full")});
  const Plan best = Planner({Method::best, {}, {1000, 10'000}}).plan(domain);
  REQUIRE(best.verdict == Verdict::best);
  Search search({1000, 10'000});
  Plan dear = best;
  dear.cost_ns *= 3;
  const Plan stopped = search.find(domain, {1, {}}, dear);
  CHECK(stopped.verdict == Verdict::found);
  CHECK(stopped.cost_ns == dear.cost_ns);
  CHECK(stopped.bound_ns > 0);
  CHECK(stopped.bound_ns <= best.cost_ns);
  int asked = 0;
  CHECK(search.find(domain, {100, [&] { return ++asked > 2; }}, {}).verdict == Verdict::gave_up);
  CHECK(Search({1, 10}).find(domain, {}, {}).verdict == Verdict::gave_up);
  CHECK(Search({1, 10}).find(domain, {}, dear).verdict == Verdict::found);
  CHECK(Search({1000, 10'000, 1}).find(domain, {}, dear).verdict ==
        Verdict::found);  // more actions than it has room for
  CHECK(search.find(domain, {}, dear).cost_ns == best.cost_ns);
}

TEST_CASE("searches take no memory but for the plan") {
  Fixture f(cup_and_bottles("9"));
  const Domain domain = f.domain({f.goal("cup_1", "level", "full")});
  Recursion recursion({});
  Search search({1000, 10'000});
  const Plan none;
  const uint64_t before = thread_memory_use().allocations;
  const Plan a = recursion.find(domain, {});
  const Plan b = search.find(domain, {}, none);
  if (counting_allocations()) CHECK(thread_memory_use().allocations - before <= 4);  // steps, as they grow
  CHECK(a.cost_ns == b.cost_ns);
}
