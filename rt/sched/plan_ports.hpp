// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "rt/sched/plan.hpp"

namespace takt {

/// Who reads outputs beside the edges of the graph.
struct Observers {
  uint32_t taps = 0;       ///< may join each output while it runs, each holding one message
  uint32_t followers = 0;  ///< likewise, but they must find every message
  int64_t kept_ns = 0;     ///< even if they look only that often
};

/// Whether that port of the task carries what its node remembers.
inline bool is_state_port(const TaskPlan& task, size_t port) {
  return task.state_every_ns > 0 && task.ports.back() == port;
}
/// Messages of a port in a second, at most. Some task makes it.
double messages_s(const Plan& plan, size_t port);

/// Fills history, held and readers of every port from the edges, deadlines and rates of the tasks, so that no message a
/// job must latch is overwritten while that job is late within its deadline, and for those that look on.
void size_ports(Plan& plan, const Observers& observers = {});

}  // namespace takt
