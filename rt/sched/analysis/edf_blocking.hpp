// SPDX-License-Identifier: Apache-2.0
// What may hold the core under non-preemptive EDF when a busy interval begins.
#pragma once
#include "rt/sched/analysis/busy_start.hpp"

namespace takt::analysis {

/// The deadlines before which a job of a task, started before `start`, is not itself due: one that is due later may
/// block. The interval may in truth begin up to `slack` earlier, all its deadlines with it (sporadic tasks move to the
/// right together with it, tasks with offsets do not).
inline Ticks blocks_deadlines_before(const TimedTask& task, Ticks start, Ticks slack) {
  if (task.sporadic) return start + task.deadline - task.jitter;
  const Ticks last = start - 1 - floor_mod(start - 1 - task.offset, task.period);
  return last + task.deadline + slack;
}

}  // namespace takt::analysis
