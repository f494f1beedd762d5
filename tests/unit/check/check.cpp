// SPDX-License-Identifier: Apache-2.0
#include "graph/check/check.hpp"

#include <doctest/doctest.h>

#include "graph/check/node_text.hpp"
#include "rt/node.hpp"

using namespace takt;
using namespace takt::graph;

namespace {

TaskPlan task(std::string name, int64_t hz, int64_t budget_ms, int64_t deadline_ms, Criticality criticality = Criticality::low) {
  TaskPlan plan;
  plan.name = std::move(name);
  plan.rate = Rate{hz, 1};
  plan.budget_ns = budget_ms * 1'000'000;
  plan.deadline_ns = deadline_ms * 1'000'000;
  plan.criticality = criticality;
  return plan;
}

Plan two_tasks() {
  Plan plan;
  plan.policy = Policy::deadline;
  plan.cores = {0, 2};
  plan.tasks = {task("stereo", 10, 50, 100, Criticality::high), task("picture", 2, 100, 450)};
  PortPlan port;
  port.node = "stereo";
  port.port = "motion";
  port.type = &MessageType::of<Motion>();
  port.history = 4;
  port.held = 3;
  plan.ports.push_back(port);
  return plan;
}

bool says(const CheckResult& result, const std::string& words) {
  for (const auto& problem : result.problems)
    if (problem.find(words) != std::string::npos) return true;
  return false;
}

struct Fake : Node {
  Input<Motion> motion{this, "motion", "where it went"};
  Input<Pose> pose{this, "pose", "where it is", Need::optional};
  Output<Grid> grid{this, "grid", "a map"};
  Param<double> range{this, "range", 8.0, {1.0, 20.0}, "m", "farthest cell"};
  Choice rule{this, "rule", "sum", {"sum", "max"}, "how cells grow"};
  void setup(Setup&) override {}
  void run(Job&) override {}
};

}  // namespace

TEST_CASE("Pools are counted from the plan") {
  const Plan plan = two_tasks();
  const CheckResult result = check({}, plan);
  REQUIRE(result.pools.size() == 1);
  CHECK(result.pools[0].output == "stereo.motion");
  CHECK(result.pools[0].chunks == 4 + 3 + 2);
  CHECK(result.pools[0].bytes == 9 * plan.ports[0].chunk_bytes());
  CHECK(result.pool_bytes == result.pools[0].bytes);
}

TEST_CASE("Utilisation is the sum of budget times rate, spread over the cores") {
  const CheckResult result = check({}, two_tasks());
  CHECK(result.verdict == Verdict::valid);
  CHECK(result.admitted);
  CHECK(result.utilisation == doctest::Approx(0.7));
  REQUIRE(result.cores.size() == 2);
  CHECK(result.cores[0].core == 0);
  CHECK(result.cores[0].utilisation == doctest::Approx(0.5));
  CHECK(result.cores[1].core == 2);
  CHECK(result.cores[1].utilisation == doctest::Approx(0.2));
  CHECK(result.tasks[0].margin_ns == 50'000'000);
  CHECK(result.text.find("Valid, admitted") != std::string::npos);
}

TEST_CASE("An `on` task runs at the rate of its producer, divided by every, bounded by min_interval") {
  Plan plan = two_tasks();
  TaskPlan follower = task("follower", 1, 1, 100);
  follower.rate.reset();
  follower.on_task = 0;
  follower.every = 2;
  plan.tasks.push_back(follower);
  CHECK(check({}, plan).tasks[2].rate_hz == doctest::Approx(5));
  plan.tasks[2].min_interval_ns = 400'000'000;
  CHECK(check({}, plan).tasks[2].rate_hz == doctest::Approx(2.5));
}

TEST_CASE("A budget above its deadline is infeasible") {
  Plan plan = two_tasks();
  plan.tasks[1].deadline_ns = 90'000'000;
  const CheckResult result = check({}, plan);
  CHECK(!result.admitted);
  CHECK(result.verdict == Verdict::valid);
  CHECK(says(result, "picture has a budget of 100ms, above its deadline of 90ms"));
}

TEST_CASE("More work than cores is infeasible and says what would fit") {
  Plan plan = two_tasks();
  plan.cores = {0};
  plan.tasks[1] = task("picture", 2, 300, 450);
  const CheckResult result = check({}, plan);
  CHECK(!result.admitted);
  CHECK(says(result, "budgets need 1.100 cores, 1 is there; picture at 1.67 Hz would make it fit"));
}

TEST_CASE("One job cannot use more than one core") {
  Plan plan = two_tasks();
  plan.tasks[1] = task("picture", 10, 150, 200);
  CHECK(says(check({}, plan), "picture needs 150ms every 100ms"));
}

TEST_CASE("Policy fixed needs a core for each task") {
  Plan plan = two_tasks();
  plan.tasks = {task("a", 1, 600, 1000, Criticality::high), task("b", 1, 600, 1000), task("c", 1, 600, 1000)};
  CHECK(check({}, plan).admitted);
  plan.policy = Policy::fixed;
  const CheckResult result = check({}, plan);
  CHECK(!result.admitted);
  CHECK(says(result, "finds no core under policy fixed"));
}

TEST_CASE("A high node without a budget is not proven, a low one is noted") {
  Plan plan = two_tasks();
  plan.tasks[1].budget_ns = 0;
  CHECK(check({}, plan).admitted);
  CHECK(check({}, plan).notes.size() == 1);
  plan.tasks[0].budget_ns = 0;
  CHECK(!check({}, plan).admitted);
  CHECK(says(check({}, plan), "not proven: stereo states no budget"));
}

TEST_CASE("Problems of the loader make the verdict Invalid, adjustments Adjusted") {
  const CheckResult failed = check_failed({{{"g.yaml", 3, 4}, "bad"}});
  CHECK(failed.verdict == Verdict::invalid);
  CHECK(!failed.admitted);
  CHECK(failed.text.find("g.yaml:3:4: error: bad") == 0);
  GraphSpec graph;
  graph.adjusted = {"policy deadline -> cooperative"};
  const CheckResult adjusted = check(graph, two_tasks());
  CHECK(adjusted.verdict == Verdict::adjusted);
  CHECK(adjusted.text.find("adjusted: policy deadline") != std::string::npos);
  CHECK(to_json(adjusted)["verdict"] == "Adjusted");
  CHECK(to_json(adjusted)["pools"][0]["chunks"] == 9);
}

TEST_CASE("takt nodes shows ports and parameters with default, unit, range") {
  NodeTypes types;
  types.add<Fake>("mapper", Layer::processing, "makes maps");
  CHECK(nodes_text(types).find("mapper             processing  makes maps") == 0);
  std::string error;
  const auto text = node_text(types, "mapper", error);
  REQUIRE(text);
  for (const char* words : {"motion", "(optional)", "grid", "farthest cell; default 8 m, range 1..20",
                            "how cells grow; default sum, range sum | max"}) {
    CAPTURE(words);
    CHECK(text->find(words) != std::string::npos);
  }
  CHECK(!node_text(types, "maper", error));
  CHECK(error.find("did you mean `mapper`?") != std::string::npos);
}
