// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "rt/sched/plan.hpp"

namespace takt::graph {

/// Fills history, held and readers of every port from the edges, deadlines and rates of the tasks, so that no message a
/// job must latch is overwritten while that job is late within its deadline.
void size_ports(Plan& plan);

}  // namespace takt::graph
