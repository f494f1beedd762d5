// SPDX-License-Identifier: Apache-2.0
#include "graph/check/ages.hpp"

#include <doctest/doctest.h>

#include "graph/check/check.hpp"
#include "graph/check/margins.hpp"
#include "rt/msg/motion.hpp"
#include "rt/node.hpp"
#include "tests/nanoseconds.hpp"

using namespace takt;
using namespace takt::graph;
using test::kMs;

namespace {

struct Source final : Node {
  Output<Motion> out{this, "out", ""};
  void setup(Setup&) override {}
  void run(Job&) override {}
};

struct Filter final : Node {
  Input<Motion> in{this, "in", ""};
  Input<Motion> other{this, "other", "", Need::optional};
  Output<Motion> out{this, "out", ""};
  void setup(Setup&) override {}
  void run(Job&) override {}
};

/// camera (0: port 0) -> stereo (1: port 1) -> map (2: port 2), each at its rate and offset.
struct Chain {
  Source camera;
  Filter stereo, map;
  Plan plan;
  GraphSpec graph;
  std::vector<NodeAdmission> nodes;

  Chain() {
    plan.policy = Policy::fixed;
    plan.cores = {0};
    add("camera", camera, 10, 0, 2);
    add("stereo", stereo, 10, 3, 6);
    add("map", map, 5, 8, 5);
    plan.tasks[0].device = true;
    plan.tasks[1].edges = {{0, 0, 1, 0}};
    plan.tasks[2].edges = {{0, 1, 1, 0}};
    graph.chains = {{"whole", {"camera", "out"}, {"map", "out"}, 200 * kMs, {}}};
  }

  void add(const char* name, Node& node, int64_t hz, int64_t offset_ms, int64_t response_ms) {
    TaskPlan task;
    task.name = name;
    task.node = &node;
    task.rate = Rate{hz, 1};
    task.offset_ns = offset_ms * kMs;
    task.budget_ns = kMs;
    task.deadline_ns = 1000 * kMs / hz;
    task.criticality = Criticality::high;
    task.ports = {plan.ports.size()};
    PortPlan port;
    port.node = name;
    port.port = "out";
    port.type = &MessageType::of<Motion>();
    plan.ports.push_back(port);
    plan.tasks.push_back(task);
    nodes.push_back({response_ms * kMs, kMs, response_ms * kMs});
  }

  AgeBound bound() const { return age_bounds(graph, plan, nodes).front(); }
};

}  // namespace

TEST_CASE("ages: each job takes what is visible at its release") {
  Chain chain;
  // stereo at 3 has the image of 0, done at 9; map at 8 therefore has that of -100, and is done at 13.
  CHECK(chain.bound().bound_ns == (100 + 8 + 5) * kMs);
  CHECK(chain.bound().least_ns == 8 * kMs);
  chain.plan.tasks[2].offset_ns = 9 * kMs;
  CHECK(chain.bound().bound_ns == (9 + 5) * kMs);
  CHECK(chain.bound().proven());
}

TEST_CASE("ages: what a device gives has an age of its own; where nobody knows it, nothing is proven") {
  Chain chain;
  const int64_t without_ns = *chain.bound().bound_ns;
  chain.plan.tasks[0].source.lag_ns = 40 * kMs;
  CHECK(chain.bound().bound_ns == without_ns + 40 * kMs);
  chain.plan.tasks[0].source.unknown = "it comes when it comes";
  CHECK_FALSE(chain.bound().bound_ns);
  CHECK(chain.bound().why == "how old what camera gives can be is not known: it comes when it comes");
}

TEST_CASE("ages: a let output is visible at the deadline") {
  Chain chain;
  chain.plan.tasks[2].offset_ns = 9 * kMs;
  chain.plan.tasks[1].publish = PublishAt::let;
  chain.plan.tasks[1].deadline_ns = 7 * kMs;  // 3 + 7 > 9
  CHECK(chain.bound().bound_ns == (100 + 9 + 5) * kMs);
}

TEST_CASE("ages: a follower takes the message that released it") {
  Chain chain;
  chain.plan.tasks[2].rate.reset();
  chain.plan.tasks[2].on_task = 1;
  chain.plan.tasks[2].on_port = 1;
  chain.nodes[2] = {5 * kMs, 6 * kMs, 11 * kMs};
  CHECK(chain.bound().bound_ns == (3 + 11) * kMs);
}

TEST_CASE("ages: the worst path counts, and depth as the oldest") {
  Chain chain;
  chain.plan.tasks[2].offset_ns = 9 * kMs;
  chain.plan.tasks[2].edges.push_back({1, 0, 4, 0});  // the image as well: younger
  CHECK(chain.bound().bound_ns == (9 + 5) * kMs);
  CHECK(chain.bound().oldest_ns == (9 + 3 * 100 + 5) * kMs);
}

TEST_CASE("ages: an input that gives an output no stamp adds nothing to its age") {
  Chain chain;
  Source slow;
  chain.add("slow", slow, 1, 0, 900);
  chain.plan.tasks[3].device = true;
  chain.plan.tasks[2].edges.push_back({1, 3, 1, 0});
  chain.graph.chains[0].from = {"slow", "out"};
  CHECK(chain.bound().bound_ns.value() > 1000 * kMs);
  chain.map.out.stamped_by({&chain.map.in});
  CHECK_FALSE(chain.bound().bound_ns);
  CHECK(chain.bound().why == "no path from a device leads there");
  chain.graph.nodes.resize(9);  // a mode has left the others out
  CHECK(age_bounds(chain.graph, chain.plan, chain.nodes).empty());
  chain.graph.nodes.clear();
  chain.graph.chains[0].from = {"camera", "out"};
  CHECK(chain.bound().bound_ns == (100 + 8 + 5) * kMs);
  // Where the job takes that input, its age counts nevertheless.
  chain.graph.chains = {{"heeded", {"slow", "out"}, {"map", "other"}, 2000 * kMs, {}}};
  CHECK(chain.bound().bound_ns.value() > 1000 * kMs);
}

TEST_CASE("ages: a device at both ends of a loop begins the path there") {
  Chain chain;
  Filter robot;
  chain.graph.chains.clear();
  chain.plan.tasks[0].node = &robot;
  chain.plan.tasks[0].edges = {{0, 2, 1, 400 * kMs}};
  const AgeBound bound = age_bounds(chain.graph, chain.plan, chain.nodes).front();
  CHECK(bound.name == "map.out -> camera.in");
  CHECK(bound.proven());
  // What map made of the image of -100 is there at 13, and still the newest at 200.
  CHECK(bound.bound_ns == (100 + 200 + 1) * kMs);
}

TEST_CASE("ages: a join waits for the slower of two outputs of one origin; of two origins nothing is known") {
  Chain chain;
  chain.plan.tasks[2].edges.push_back({1, 0, 1, 0});
  chain.plan.tasks[2].joins = {{0, 1}};
  CHECK(chain.bound().bound_ns == (100 + 8 + 5) * kMs);
  Source second;
  chain.add("second", second, 10, 0, 2);
  chain.plan.tasks[3].device = true;
  chain.plan.tasks[2].edges[1].port = 3;
  CHECK(!chain.bound().bound_ns);
  CHECK(chain.bound().why.find("map joins outputs of stereo and second") == 0);
}

TEST_CASE("ages: an edge's max_age asks for the age where the job has its message") {
  Chain chain;
  chain.graph.chains.clear();
  chain.plan.tasks[2].edges[0].max_age_ns = 120 * kMs;
  const AgeBound bound = age_bounds(chain.graph, chain.plan, chain.nodes).front();
  CHECK(bound.name == "stereo.out -> map.in");
  CHECK(bound.bound_ns == (100 + 8 + 1) * kMs);
  CHECK(bound.proven());
}

TEST_CASE("ages: what no execution can meet is Invalid, what is not shown is refused") {
  Chain chain;
  chain.graph.chains[0].max_age_ns = 7 * kMs;  // the map is released 8 ms after the image
  const CheckResult invalid = check(chain.graph, chain.plan);
  CHECK(invalid.verdict == Verdict::invalid);
  CHECK(invalid.text.find("even if every job took no time") != std::string::npos);
  chain.graph.chains[0].max_age_ns = 100 * kMs;
  chain.plan.tasks[2].offset_ns = 4 * kMs;  // stereo may take longer than 1 ms: another lane goes before it
  chain.plan.tasks[1].budget_ns = 2 * kMs;
  const CheckResult late = check(chain.graph, chain.plan);
  CHECK(late.verdict == Verdict::valid);
  CHECK(late.answer == Answer::not_proven);
  CHECK(late.problems.front().find("chain whole: max_age is 100 ms, and the bound on its age is") == 0);
  // What would do is said: here stereo's answer in time for the map, which any of these figures brings about.
  REQUIRE(late.modes.front().change.find("the smallest single change that makes it fit: ") == 0);
  CHECK(late.json["change"] == late.modes.front().change);
}

TEST_CASE("ages: the smallest change that makes an age fit does, and a little less does not") {
  Chain chain;
  chain.graph.chains[0].max_age_ns = 112 * kMs;
  const CheckResult refused = check(chain.graph, chain.plan);
  REQUIRE(refused.answer == Answer::admitted);
  chain.graph.chains[0].max_age_ns = 100 * kMs;
  chain.plan.tasks[2].offset_ns = 4 * kMs;
  chain.plan.tasks[1].budget_ns = 2 * kMs;
  const auto accepted = [&](const Plan& plan) { return check(chain.graph, plan).admitted; };
  REQUIRE_FALSE(accepted(chain.plan));
  const auto change = smallest_age_change(chain.plan, accepted, {});
  REQUIRE(change);
  CAPTURE(to_string(*change, chain.plan));
  const auto with = [&](double share) {
    Plan changed = chain.plan;
    TaskPlan& task = changed.tasks[change->task];
    const double value = change->from + share * (change->to - change->from);
    if (change->what == Change::What::offset) task.offset_ns = static_cast<int64_t>(value * 1e6 + 0.5);
    else if (change->what == Change::What::budget) task.budget_ns = static_cast<int64_t>(value * 1e6);
    else if (change->what == Change::What::rate) task.rate = Rate{static_cast<int64_t>(value * 10 + 0.5), 10};
    return accepted(changed);
  };
  CHECK(with(1));
  CHECK_FALSE(with(0.98));
  // One later max_age is preferred where it is the smaller change.
  const Change later{Change::What::max_age, kNone, 100, 100.001, 1e-5, "chain whole"};
  CHECK(to_string(*smallest_age_change(chain.plan, accepted, later), chain.plan) ==
        "raise the max_age of chain whole from 100 ms to 100.001 ms");
}
