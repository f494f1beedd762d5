// SPDX-License-Identifier: Apache-2.0
// Quality levels in a run in virtual time: the level a job gets, the one its messages carry, what is counted; and how
// much time a job has left.
#include <doctest/doctest.h>

#include <algorithm>
#include <vector>

#include "rt/msg/odometry.hpp"
#include "rt/node.hpp"
#include "rt/sched/executor.hpp"
#include "rt/sched/port_access.hpp"
#include "tests/nanoseconds.hpp"

namespace {

using namespace takt;
using test::kMs;

struct Degrading final : Node {
  Levels levels{this, {{"full", 1.0}, {"half", 0.5}}};
  Output<Odometry> out{this, "out", "test data"};
  std::vector<int> seen;
  std::vector<int64_t> left_ms;
  void setup(Setup&) override {}
  void run(Job& job) override {
    seen.push_back(job.level());
    left_ms.push_back(job.time_left_ns() / kMs);
    if (out.loan() != nullptr) out.send(job.release_ns());
  }
};

struct LevelReader final : Node {
  Input<Odometry> in{this, "in", "test data"};
  std::vector<int> seen;
  void setup(Setup&) override {}
  void run(Job&) override { seen.push_back(in.empty() ? -1 : in.level(in.size() - 1)); }
};

/// Jobs take exactly their budget, at level 1 half of it; a deadline below the budget is the overrun.
struct DegradeScene {
  Degrading node;
  LevelReader reader;
  Plan plan;
  VirtualClock clock{1'000'000'000};

  DegradeScene(int64_t budget_ns, int64_t deadline_ns, OnOverrun on_overrun) {
    plan.tasks.resize(2);
    plan.ports.resize(1);
    plan.ports[0].type = &node.out.type();
    plan.ports[0].held = 1;
    add(plan.tasks[0], "node", node, budget_ns, deadline_ns);
    plan.tasks[0].on_overrun = on_overrun;
    plan.tasks[0].ports = {0};
    add(plan.tasks[1], "reader", reader, kMs, 100 * kMs);
    plan.tasks[1].offset_ns = 90 * kMs;
    plan.tasks[1].edges = {{0, 0, 1, 0}};
    PortAccess::connect(reader.in, {});
  }
  static void add(TaskPlan& task, const char* name, Node& node, int64_t budget_ns, int64_t deadline_ns) {
    task.name = name;
    task.node = &node;
    task.rate = Rate{10, 1};
    task.budget_ns = budget_ns;
    task.deadline_ns = deadline_ns;
  }
  const TaskStatistics& run(int jobs) {
    transport = make_local_transport(plan.ports);
    executor = std::make_unique<Executor>(plan, *transport, clock, Executor::Options{jobs * 100 * kMs, 0, false});
    executor->run();
    return executor->board().task(0);
  }
  std::unique_ptr<Transport> transport;
  std::unique_ptr<Executor> executor;
};

}  // namespace

TEST_CASE("degrade: the job after an overrun runs at level 1, its message says so, the report can count it") {
  DegradeScene scene(30 * kMs, 20 * kMs, OnOverrun::degrade);
  const TaskStatistics& counted = scene.run(20);
  REQUIRE(scene.node.seen.size() == 20);
  CHECK(scene.node.seen[0] == 0);
  CHECK(std::count(scene.node.seen.begin(), scene.node.seen.end(), 1) == 19);
  CHECK(scene.reader.seen == scene.node.seen);  // each reads the message of its own period
  CHECK(counted.at_level[0].load() == 1);
  CHECK(counted.at_level[1].load() == 19);
  CHECK(counted.level_changes.load() == 1);
  CHECK(counted.changes[0].level == 1);
  CHECK(counted.changes[0].release_ns == 1'100'000'000);
  CHECK(counted.deadline_misses.load() == 1);
}

TEST_CASE("continue: the level stays 0, whatever happens") {
  DegradeScene scene(30 * kMs, 20 * kMs, OnOverrun::proceed);
  const TaskStatistics& counted = scene.run(20);
  CHECK(std::count(scene.node.seen.begin(), scene.node.seen.end(), 0) == 20);
  CHECK(counted.at_level[0].load() == 20);
  CHECK(counted.deadline_misses.load() == 20);
}

TEST_CASE("a node that fits keeps level 0 under degrade") {
  DegradeScene scene(20 * kMs, 20 * kMs, OnOverrun::degrade);
  CHECK(scene.run(20).level_changes.load() == 0);
  CHECK(scene.node.seen.back() == 0);
}

TEST_CASE("time left: to the deadline or to the end of the budget, whichever comes first") {
  DegradeScene tight_budget(5 * kMs, 20 * kMs, OnOverrun::proceed),
      tight_deadline(30 * kMs, 20 * kMs, OnOverrun::proceed);
  tight_budget.run(2);
  tight_deadline.run(2);
  CHECK(tight_budget.node.left_ms == std::vector<int64_t>{5, 5});
  CHECK(tight_deadline.node.left_ms == std::vector<int64_t>{20, 20});

  static int64_t cpu_ns = 0;
  VirtualClock clock(100 * kMs);
  cpu_ns = 7 * kMs;
  const auto used = [] { return cpu_ns; };
  Job job(clock, 0, 100 * kMs, 160 * kMs, 0, "full", {10 * kMs, 5 * kMs, used});
  CHECK(job.time_left_ns() == 8 * kMs);  // 2 of 10 ms used
  cpu_ns += 9 * kMs;
  CHECK(job.time_left_ns() == -kMs);
  clock.advance_to(165 * kMs);
  CHECK(job.time_left_ns() == -5 * kMs);
  CHECK(Job(clock, 0, 100 * kMs, 160 * kMs, 0, "full").time_left_ns() == -5 * kMs);
}
