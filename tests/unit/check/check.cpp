// SPDX-License-Identifier: Apache-2.0
#include "graph/check/check.hpp"

#include <doctest/doctest.h>

#include "plans.hpp"
#include "rt/msg/grid.hpp"
#include "rt/msg/motion.hpp"
#include "rt/msg/pose.hpp"
#include "rt/node.hpp"

using namespace takt;
using namespace takt::graph;
using test::task;

namespace {

Plan two_tasks() {
  Plan plan;
  plan.policy = Policy::deadline;
  plan.cores = {0, 2};
  plan.tasks = {task("stereo", 10, 50, 100, Criticality::high), task("picture", 2, 100, 450, Criticality::low)};
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
  CHECK(result.json["pools"][0]["chunks"] == 9);
}

TEST_CASE("Utilisation is the sum of budget times rate, spread over the cores") {
  const CheckResult result = check({}, two_tasks());
  CHECK(result.verdict == Verdict::valid);
  CHECK(result.admitted);
  CHECK(result.problems.empty());
  CHECK(result.utilisation == doctest::Approx(0.7));
  REQUIRE(result.core_use.size() == 2);
  CHECK(result.core_use[0].core == 0);
  CHECK(result.core_use[0].utilisation == doctest::Approx(0.5));
  CHECK(result.core_use[1].core == 2);
  CHECK(result.core_use[1].utilisation == doctest::Approx(0.2));
}

TEST_CASE("Exactly full cores are admitted if ordinary threads have no share of them") {
  Plan plan = two_tasks();
  plan.cores = {0};
  plan.policy = Policy::fixed;
  plan.tasks.clear();
  for (int i = 0; i < 10; ++i) plan.tasks.push_back(task("n" + std::to_string(i), 10, 10, 100, Criticality::high));
  CHECK(check({}, plan).admitted);
  // 50 ms of each second, which the kernel gives up to 1 ms early: with 949 ms taken that comes to pass by itself.
  CheckOptions options;
  options.machine.overheads.ordinary_runtime_ns = 50'000'000;
  options.machine.overheads.ordinary_period_ns = 1'000'000'000;
  CHECK(!check({}, plan, options).admitted);
  for (TaskPlan& node : plan.tasks) node.budget_ns = 9'490'000;
  CHECK(check({}, plan, options).admitted);
  plan.tasks[0].budget_ns += 100'000;
  CHECK(says(check({}, plan, options), "budgets and overheads ask for 1.00 of 1 core"));
  // A job of 1200 ms leaves no 51 ms of a second free: the share goes before it, late once and then at once.
  plan.tasks = {task("long", 1, 1200, 1400, Criticality::high)};
  plan.tasks[0].rate = Rate{1, 2};
  CHECK(check({}, plan, options).admitted);
  CHECK(check({}, plan, options).modes[0].admission.nodes[0].response_ns == 1'353'000'000);
  plan.tasks[0].deadline_ns = 1'350'000'000;
  CHECK(says(check({}, plan, options), "long may take 1353.000 ms from its release and has 1350.000 ms"));
  CHECK(check({}, plan, options).answer == Answer::not_proven);
  plan.tasks.clear();
  for (int i = 0; i < 10; ++i) plan.tasks.push_back(task("n" + std::to_string(i), 10, 10, 100, Criticality::high));
  for (TaskPlan& node : plan.tasks) node.budget_ns = 10'000'000;
  // SCHED_DEADLINE reserves over 0.95 of a period: a full core does not fit.
  plan.policy = Policy::deadline;
  CHECK(!check({}, plan).admitted);
}

TEST_CASE("A budget above its deadline is infeasible") {
  Plan plan = two_tasks();
  plan.tasks[1].deadline_ns = 90'000'000;
  const CheckResult result = check({}, plan);
  CHECK(!result.admitted);
  CHECK(result.verdict == Verdict::valid);
  REQUIRE(result.problems.size() == 1);
  CHECK(says(result, "picture: its budget of 100 ms is above its deadline of 90 ms"));
  CHECK(result.text.find(result.problems[0]) != std::string::npos);
}

TEST_CASE("More work than cores, or than one core for one task, is infeasible") {
  Plan plan = two_tasks();
  plan.cores = {0};
  plan.tasks[1] = task("picture", 2, 300, 450, Criticality::low);
  CHECK(says(check({}, plan), "budgets ask for 1.10 of 1 core"));
  CHECK(!check({}, plan).admitted);
  plan = two_tasks();
  plan.tasks[1] = task("picture", 10, 150, 200, Criticality::low);
  CHECK(says(check({}, plan), "picture: its budget of 150 ms at 10 Hz is more than one core"));
  CHECK(says(check({}, plan), "at most 6.667 Hz would fit"));
}

TEST_CASE("A task without a budget is named, not counted, and nothing is proven") {
  Plan plan = two_tasks();
  plan.tasks[1].budget_ns = 0;
  const CheckResult result = check({}, plan);
  CHECK(!result.admitted);
  CHECK(result.answer == Answer::not_proven);
  CHECK(says(result, "picture: no budget stated"));
  CHECK(result.unbudgeted == std::vector<std::string>{"picture"});
  CHECK(result.utilisation == doctest::Approx(0.5));
}

TEST_CASE("Problems of the loader make the verdict Invalid, adjustments Adjusted") {
  Problem bad;
  bad.position = {"g.yaml", 3, 4};
  bad.text = "bad";
  const CheckResult failed = check_failed({bad});
  CHECK(failed.verdict == Verdict::invalid);
  CHECK(!failed.admitted);
  CHECK(failed.text.find("g.yaml:3:4: error: bad") == 0);
  GraphSpec graph;
  graph.adjusted = {"policy deadline -> cooperative"};
  const CheckResult adjusted = check(graph, two_tasks());
  CHECK(adjusted.verdict == Verdict::adjusted);
  CHECK(adjusted.json["verdict"] == "Adjusted");
}

TEST_CASE("takt nodes shows ports and parameters with default, unit, range and meaning") {
  NodeTypes types;
  types.add<Fake>("mapper", Layer::processing, "makes maps");
  const std::string list = nodes_text(types);
  for (const char* words : {"mapper", "processing", "makes maps"}) CHECK(list.find(words) != std::string::npos);
  const std::string text = node_text(*types.find("mapper"));
  for (const char* words :
       {"where it is (optional)", "grid", "farthest cell", "1..20", "sum | max", "how cells grow"}) {
    CAPTURE(words);
    CHECK(text.find(words) != std::string::npos);
  }
  // Below its heading, behind two blanks: docs/reference is made from that.
  const auto column = [&](const char* words) {
    const size_t at = text.find(words);
    REQUIRE(at != std::string::npos);
    return at - text.rfind('\n', at);
  };
  CHECK(column("valid") == column("1..20"));
  CHECK(column("valid") == column("sum | max"));
  CHECK(column("meaning") == column("  how cells grow") + 2);
}
