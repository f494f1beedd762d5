// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <map>
#include <memory>
#include <queue>
#include <random>

#include "nodes/planner/planner.hpp"
#include "tests/going_on.hpp"
#include "tests/property_scale.hpp"

using namespace takt::planner;
using namespace takt::semantic;

namespace {

constexpr MapParameters kSmall{{40, 200}, 0.5, 20, 20, 0, 0};

/// A random small domain: its network, and goals.
struct RandomTask {
  SemanticMap map{kSmall};
  std::vector<Goal> goals;
  takt::planner::Place robot;

  explicit RandomTask(uint64_t seed) {
    std::mt19937 random(seed);
    const auto below = [&](size_t n) { return static_cast<uint32_t>(random() % n); };
    const auto coordinate = [&] { return std::uniform_real_distribution<double>(0, 9.9)(random); };
    std::vector<NodeId> types, objects;
    std::vector<std::vector<NodeId>> attributes(2);
    for (const char* name : {"t0", "t1"}) types.push_back(*map.add_type(name));
    for (const char* name : {"a0", "a1", "a2"}) {
      Attribute attribute{ValueKind::enumerated, "", 0, 1, {"u", "v", "w"}, false};
      attribute.words.resize(2 + below(2));
      const NodeId node = *map.add_attribute(name, attribute);
      for (size_t t = 0; t < 2; ++t)
        if (below(3) != 0 || (attributes[t].empty() && name[1] == '2')) {
          REQUIRE(map.add_to_type(types[t], node));
          attributes[t].push_back(node);
        }
    }
    const auto any_value = [&](NodeId attribute) {
      return Word{static_cast<uint16_t>(below(map.attribute(attribute).words.size()))};
    };
    for (uint32_t i = 8 + below(9); i > 0; --i) {
      Action action;
      std::vector<uint32_t> type_of;
      for (uint32_t roles = 1 + below(2); roles > 0; --roles) {
        type_of.push_back(below(2));
        action.roles.push_back({std::string(1, static_cast<char>('a' + roles)), types[type_of.back()]});
      }
      const auto clauses = [&](uint32_t count, std::vector<Clause>& into) {
        for (; count > 0; --count) {
          const uint32_t role = below(action.roles.size());
          const auto& of = attributes[type_of[role]];
          const NodeId attribute = of[below(of.size())];
          const bool there = std::any_of(into.begin(), into.end(),
                                         [&](const Clause& c) { return c.role == role && c.attribute == attribute; });
          if (!there) into.push_back({role, attribute, any_value(attribute)});
        }
      };
      clauses(below(3), action.required);
      clauses(1 + below(2), action.results);
      action.cost_s = 0.5 + 0.1 * below(50);
      REQUIRE(map.add_action("c" + std::to_string(i), std::move(action)));
    }
    for (uint32_t i = 2 + below(3); i > 0; --i) {
      const uint32_t type = below(2);
      objects.push_back(*map.add_object(types[type], coordinate(), coordinate()));
      for (const NodeId attribute : attributes[type])
        if (below(8) != 0) REQUIRE(map.set_state(objects.back(), attribute, any_value(attribute)));
    }
    for (uint32_t i = 1 + below(3); i > 0; --i) {
      const NodeId object = objects[below(objects.size())];
      const auto& of = attributes[map.network().connected(object, types[0]) ? 0 : 1];
      const NodeId attribute = of[below(of.size())];
      Value wanted = any_value(attribute);
      while (wanted == map.state(object, attribute)) wanted = any_value(attribute);
      goals.push_back({object, attribute, wanted});
    }
    robot = {coordinate(), coordinate()};
  }
};

/// Least cost by looking at every state that can be reached (Dijkstra), with every action and every way to fill its
/// roles; -1: the goals cannot be reached.
int64_t exhaustive(const RandomTask& task, CostMode mode) {
  const SemanticMap& map = task.map;
  const std::vector<NodeId> objects = map.all(Kind::object), attributes = map.all(Kind::attribute);
  const Travel travel = straight_lines(0.7);
  // Values of all objects and attributes, then the place: an object, or kNoNode where the robot was first.
  using World = std::pair<std::vector<int>, NodeId>;
  const auto slot = [&](NodeId object, NodeId attribute) {
    const auto o = std::find(objects.begin(), objects.end(), object) - objects.begin();
    const auto a = std::find(attributes.begin(), attributes.end(), attribute) - attributes.begin();
    return static_cast<size_t>(o) * attributes.size() + static_cast<size_t>(a);
  };
  const auto code = [](const Value& value) { return known(value) ? std::get<Word>(value).index : -1; };
  const auto place = [&](NodeId at) {
    return at == kNoNode ? task.robot : takt::planner::Place{map.object(at).x_m, map.object(at).y_m};
  };
  World begin{{}, kNoNode};
  for (const NodeId object : objects)
    for (const NodeId attribute : attributes) begin.first.push_back(code(map.state(object, attribute)));

  std::map<World, int64_t> cost{{begin, 0}};
  using Entry = std::pair<int64_t, World>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  open.push({0, begin});
  while (!open.empty()) {
    const int64_t so_far = open.top().first;
    const World world = open.top().second;
    open.pop();
    if (cost[world] < so_far) continue;
    if (std::all_of(task.goals.begin(), task.goals.end(),
                    [&](const Goal& g) { return world.first[slot(g.object, g.attribute)] == code(g.value); }))
      return so_far;
    for (const NodeId node : map.all(Kind::action)) {
      const Action& action = map.action(node);
      for (const NodeId first : objects)
        for (const NodeId second : objects) {
          const std::vector<NodeId> filled = action.roles.size() == 1 ? std::vector{first} : std::vector{first, second};
          if (action.roles.size() == 1 ? first != second : first == second) continue;
          bool possible = true;
          for (size_t r = 0; r < filled.size(); ++r)
            possible = possible && map.network().connected(filled[r], action.roles[r].type);
          for (const Clause& c : action.required)
            possible = possible && world.first[slot(filled[c.role], c.attribute)] == code(c.value);
          if (!possible) continue;
          Entry next{so_far + std::llround(action.cost_s * 1e9), world};
          for (const Clause& c : action.results) next.second.first[slot(filled[c.role], c.attribute)] = code(c.value);
          for (const NodeId object : filled) {
            next.first += travel(place(mode == CostMode::faithful ? kNoNode : next.second.second), place(object));
            next.second.second = object;
          }
          const auto [known, added] = cost.try_emplace(next.second, next.first);
          if (!added && known->second <= next.first) continue;
          known->second = next.first;
          open.push(next);
        }
    }
  }
  return -1;
}

/// Does what the plan says; its cost if all of it was possible and the goals hold then, else -1.
int64_t executed(RandomTask& task, const Domain& domain, const Plan& plan) {
  uint32_t place = 0;
  int64_t cost = 0;
  for (const Step& step : plan.steps) {
    const GroundAction& ground = domain.actions[step.action];
    const Action& action = task.map.action(ground.action);
    if (!task.map.possible(action, ground.objects)) return -1;
    task.map.apply(action, ground.objects);
    cost += domain.drive_ns(place, ground) + ground.cost_ns;
    place = ground.places.back();
  }
  for (const Goal& goal : task.goals)
    if (task.map.state(goal.object, goal.attribute) != goal.value) return -1;
  return cost;
}

}  // namespace

TEST_CASE("on 1,000 random small domains the planner's cost is that of exhaustive search") {
  Planner best({Method::best, {}, {60'000, 600'000}});
  Planner recursive({Method::recursive, {}, {1, 1}});
  Search alone({60'000, 600'000});
  size_t solvable = 0, dearer = 0, missed = 0, long_plans = 0;
  for (uint32_t seed = 1; seed <= takt::test::rounds(1000u); ++seed) {
    CAPTURE(seed);
    RandomTask task(takt::test::seed(seed));
    const CostMode mode = seed % 5 == 0 ? CostMode::faithful : CostMode::sequential;
    const auto domain = ground(task.map, task.goals, task.robot, {mode, 0.7, {}, 200'000});
    REQUIRE(domain);
    const int64_t truth = exhaustive(task, mode);
    const Plan plan = best.plan(*domain);
    REQUIRE(plan.cost_ns == truth);
    REQUIRE(plan.verdict == (truth < 0 ? Verdict::none : Verdict::best));
    REQUIRE(alone.find(*domain, {}, {}).cost_ns == truth);
    const Plan thesis = recursive.plan(*domain);
    if (truth < 0) {
      REQUIRE_FALSE(thesis.exists());
      continue;
    }
    ++solvable;
    long_plans += plan.steps.size() > 2;
    missed += !thesis.exists();
    dearer += thesis.exists() && thesis.cost_ns > truth;
    if (thesis.exists()) {
      REQUIRE(thesis.cost_ns >= truth);
      RandomTask again(takt::test::seed(seed));
      REQUIRE(executed(again, *domain, thesis) == thesis.cost_ns);
    }
    REQUIRE(executed(task, *domain, plan) == plan.cost_ns);
  }
  MESSAGE(solvable << " of " << takt::test::rounds(1000) << " have a plan, " << long_plans
                   << " of more than two steps; the recursion is dearer in " << dearer << " and finds none in "
                   << missed);
  CHECK(solvable >= takt::test::at_scale(300));
  CHECK(long_plans >= takt::test::at_scale(50));
  CHECK(dearer >= takt::test::at_scale(1));
}

TEST_CASE("a search in portions of any size ends with the plan of one that is not interrupted") {
  Planner whole({Method::best, {}, {60'000, 600'000}}), portions({Method::best, {}, {60'000, 600'000}});
  size_t interrupted = 0;
  for (uint32_t seed = 1; seed <= takt::test::rounds(300u); ++seed) {
    RandomTask task(takt::test::seed(seed));
    const auto domain = ground(task.map, task.goals, task.robot, {});
    REQUIRE(domain);
    const Plan plan = whole.plan(*domain);
    portions.begin(*domain, {});
    const Effort portion{1 + seed % 3, {}};
    size_t calls = 1;
    for (; !portions.go_on(portion); ++calls) {
      const Plan& so_far = portions.best_so_far();
      REQUIRE(so_far.expanded == calls * portion.expansions);
      if (plan.exists()) REQUIRE(so_far.bound_ns <= plan.cost_ns);
      if (so_far.exists()) REQUIRE(so_far.cost_ns >= plan.cost_ns);
    }
    interrupted += calls > 1;
    const Plan& last = portions.best_so_far();
    REQUIRE(last.verdict == plan.verdict);
    REQUIRE(last.cost_ns == plan.cost_ns);
    REQUIRE(last.expanded == plan.expanded);
    REQUIRE(last.steps.size() == plan.steps.size());
    for (size_t i = 0; i < plan.steps.size(); ++i) REQUIRE(last.steps[i].action == plan.steps[i].action);
  }
  CHECK(interrupted >= takt::test::at_scale(50));
}

namespace {

/// A planner that goes on in another one after each portion.
struct Interrupted {
  const Domain& domain;
  Planner planner{{Method::best, {}, {6'000, 60'000}}};
  void remember(takt::StateArchive& archive) { planner.remember(archive, domain); }
};

}  // namespace

TEST_CASE("a search that goes on from what was remembered ends as one that is not interrupted") {
  Planner whole({Method::best, {}, {6'000, 60'000}});
  size_t interrupted = 0;
  for (uint32_t seed = 1; seed <= takt::test::rounds(100u); ++seed) {
    RandomTask task(takt::test::seed(seed));
    const auto domain = ground(task.map, task.goals, task.robot, {});
    REQUIRE(domain);
    const Plan plan = whole.plan(*domain);
    auto now = std::make_unique<Interrupted>(*domain);
    now->planner.begin(*domain, {});
    for (; !now->planner.go_on({1 + seed % 3, {}}); ++interrupted)
      now = takt::test::going_on(*now, std::make_unique<Interrupted>(*domain));
    now = takt::test::going_on(*now, std::make_unique<Interrupted>(*domain));
    const Plan& last = now->planner.best_so_far();
    REQUIRE(last.verdict == plan.verdict);
    REQUIRE(last.cost_ns == plan.cost_ns);
    REQUIRE(last.bound_ns == plan.bound_ns);
    REQUIRE(last.expanded == plan.expanded);
    REQUIRE(last.steps.size() == plan.steps.size());
    for (size_t i = 0; i < plan.steps.size(); ++i) REQUIRE(last.steps[i].action == plan.steps[i].action);
  }
  CHECK(interrupted >= takt::test::at_scale(50));
}

TEST_CASE("whenever a search is ended, its plan is one and its bound holds") {
  size_t early = 0;
  for (uint32_t seed = 1; seed <= takt::test::rounds(150u); ++seed) {
    RandomTask task(takt::test::seed(seed));
    const auto domain = ground(task.map, task.goals, task.robot, {});
    REQUIRE(domain);
    const int64_t truth = exhaustive(task, CostMode::sequential);
    Planner planner({Method::best, {}, {60'000, 600'000}});
    for (const size_t expansions : {1, 2, 4, 8, 16}) {
      const Plan plan = planner.plan(*domain, {expansions, {}});
      early += plan.verdict == Verdict::found || plan.verdict == Verdict::gave_up;
      if (truth >= 0) REQUIRE(plan.bound_ns <= truth);
      if (!plan.exists()) continue;
      REQUIRE(plan.cost_ns >= truth);
      RandomTask again(takt::test::seed(seed));
      REQUIRE(executed(again, *domain, plan) == plan.cost_ns);
    }
  }
  CHECK(early >= takt::test::at_scale(50));
}
