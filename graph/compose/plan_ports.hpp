// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "rt/sched/plan.hpp"

namespace takt::graph {

/// Rate at which a task runs: its own, or that of the producer whose output releases it (divided by `every`); 0 if none.
double effective_rate_hz(const Plan& plan, size_t task);

/// Fills history, held and readers of every port from the edges, deadlines and rates of the tasks, so that no message a
/// job must latch is overwritten while that job is late within its deadline.
void size_ports(Plan& plan);

}  // namespace takt::graph
