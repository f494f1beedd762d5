// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "rt/sched/plan.hpp"

namespace takt::graph {

/// Fills history, held and readers of every port from the edges, deadlines and rates of the tasks, so that no message a
/// job must latch is overwritten while that job is late within its deadline. `taps` readers more may join each output
/// while it runs, each holding one message.
void size_ports(Plan& plan, uint32_t taps = 0);

}  // namespace takt::graph
