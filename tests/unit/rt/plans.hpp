// SPDX-License-Identifier: Apache-2.0
// Parts of plans for tests of runs.
#pragma once
#include "rt/msg/odometry.hpp"
#include "rt/node.hpp"
#include "rt/sched/plan.hpp"

namespace takt::test {

/// Does nothing.
struct Idle final : Node {
  Output<Odometry> out{this, "out", ""};
  void setup(Setup&) override {}
  void run(Job&) override {}
};

/// Appends `node` at 10 Hz, with a deadline of 100 ms, a budget of 1 ms and its first output as a port.
inline void add_task(Plan& plan, Node& node, const char* name, int64_t offset_ns, const Capacity& capacity = {}) {
  TaskPlan task;
  task.name = name;
  task.node = &node;
  task.rate = Rate{10, 1};
  task.offset_ns = offset_ns;
  task.budget_ns = 1'000'000;
  task.deadline_ns = 100'000'000;
  task.ports.push_back(plan.ports.size());
  PortPlan port;
  port.node = name;
  port.type = &node.outputs()[0]->type();
  port.capacity = capacity;
  port.history = 4;
  plan.ports.push_back(port);
  plan.tasks.push_back(task);
}

}  // namespace takt::test
