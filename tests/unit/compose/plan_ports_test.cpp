// SPDX-License-Identifier: Apache-2.0
// Pools that the graph sizes, in runs that need all of them.
#include "rt/sched/plan_ports.hpp"

#include <doctest/doctest.h>

#include "rt/msg/odometry.hpp"
#include "rt/sched/executor.hpp"
#include "rt/sched/port_access.hpp"
#include "tests/nanoseconds.hpp"

namespace {

using namespace takt;
using test::kMs;

/// Sends on the stamp of what it reads; of its release where it reads nothing.
struct Relay final : Node {
  Input<Odometry> in{this, "in", "test data", Need::optional};
  Output<Odometry> out{this, "out", "test data"};
  void setup(Setup&) override {}
  void run(Job& job) override {
    if (in.connected() && in.empty()) return job.no_result();
    REQUIRE(out.loan() != nullptr);
    out.send(in.empty() ? job.release_ns() : in.stamp_ns());
  }
};

/// Joins what comes directly with what came the long way.
struct Joiner final : Node {
  Input<Odometry> fast{this, "fast", "test data"};
  Input<Odometry> slow{this, "slow", "test data"};
  size_t jobs = 0, stale = 0;
  bool begun = false;
  void setup(Setup&) override {}
  void run(Job&) override {
    begun = begun || !fast.stale();
    jobs += begun;
    stale += begun && fast.stale();
    if (!fast.stale()) CHECK(fast.stamp_ns() == slow.stamp_ns());
  }
};

struct Chain {
  Plan plan;
  VirtualClock clock{1'000'000'000};

  size_t add(Node& node, const char* name, Rate rate, int64_t deadline_ns, int64_t budget_ns) {
    TaskPlan task;
    task.name = name;
    task.node = &node;
    task.rate = rate;
    task.deadline_ns = deadline_ns;
    task.budget_ns = budget_ns;
    for (const OutputPort* output : node.outputs()) {
      task.ports.push_back(plan.ports.size());
      PortPlan port;
      port.node = name;
      port.port = output->name();
      port.type = &output->type();
      plan.ports.push_back(port);
    }
    plan.tasks.push_back(task);
    return plan.tasks.size() - 1;
  }
  void edge(size_t from, size_t to, size_t input) {
    plan.tasks[to].edges.push_back({input, plan.tasks[from].ports[0], 1, 0});
    PortAccess::connect(*plan.tasks[to].node->inputs()[input], {});
  }
};

}  // namespace

TEST_CASE("a joined message is kept until the partner with its stamp can be there, however long that takes") {
  for (const Rate slow : {Rate{5, 1}, Rate{1, 1}, Rate{2, 5}}) {
    CAPTURE(slow.hz());
    Chain chain;
    Relay camera, first, second;
    Joiner joiner;
    const size_t source = chain.add(camera, "camera", {15, 1}, 10 * kMs, kMs);
    const size_t one = chain.add(first, "first", {10, 1}, 50 * kMs, 5 * kMs);
    const size_t two = chain.add(second, "second", slow, 60 * kMs, 5 * kMs);
    const size_t sink = chain.add(joiner, "joiner", {15, 1}, 20 * kMs, kMs);
    chain.edge(source, one, 0);
    chain.edge(one, two, 0);
    chain.edge(source, sink, 0);
    chain.edge(two, sink, 1);
    chain.plan.tasks[sink].joins = {{0, 1}};
    size_ports(chain.plan);
    const auto transport = make_local_transport(chain.plan.ports);
    Executor executor(chain.plan, *transport, chain.clock, {20'000 * kMs, 0, false});
    executor.run();
    CHECK(joiner.jobs > 200);
    CHECK(joiner.stale == 0);
    // Not without end: a period, a late start and a deadline for each of the three, and what the others ask for.
    const int64_t oldest_ms = (67 + 67 + 10) + (100 + 100 + 50) + 2 * slow.period_ns() / kMs + 60;
    CHECK(chain.plan.ports[0].history <= 1 + 3 + 2 + (oldest_ms * 15 + 999) / 1000 + 1);
  }
}

TEST_CASE("a join in a loop is sized by the way from the device, and ends") {
  Chain chain;
  Relay camera, back;
  Joiner joiner;
  const size_t source = chain.add(camera, "camera", {15, 1}, 10 * kMs, kMs);
  const size_t loop = chain.add(back, "back", {15, 1}, 20 * kMs, kMs);
  const size_t sink = chain.add(joiner, "joiner", {15, 1}, 20 * kMs, kMs);
  chain.edge(loop, loop, 0);  // reads what it said itself
  chain.edge(source, sink, 0);
  chain.edge(loop, sink, 1);
  chain.plan.tasks[sink].joins = {{0, 1}};
  size_ports(chain.plan);
  CHECK(chain.plan.ports[0].history >= 1 + 2 + 2 + 3);
  CHECK(chain.plan.ports[0].history < 20);
}
