// SPDX-License-Identifier: Apache-2.0
// Plans of tasks without nodes.
#pragma once
#include <string>
#include <utility>
#include <vector>

#include "rt/sched/plan.hpp"
#include "tests/nanoseconds.hpp"

namespace takt::test {

inline TaskPlan task(std::string name, int64_t hz, double budget_ms, double deadline_ms,
                     Criticality criticality = Criticality::high) {
  TaskPlan plan;
  plan.name = std::move(name);
  plan.rate = Rate{hz, 1};
  plan.budget_ns = static_cast<int64_t>(budget_ms * 1e6);
  plan.deadline_ns = static_cast<int64_t>(deadline_ms * 1e6);
  plan.criticality = criticality;
  return plan;
}

inline Plan plan_of(Policy policy, std::vector<int> cores, std::vector<TaskPlan> tasks) {
  Plan plan;
  plan.policy = policy;
  plan.cores = std::move(cores);
  plan.tasks = std::move(tasks);
  return plan;
}

/// `follower` runs when `producer` has published.
inline void follow(Plan& plan, size_t follower, size_t producer) {
  plan.tasks[follower].rate.reset();
  plan.tasks[follower].on_task = producer;
}

}  // namespace takt::test
