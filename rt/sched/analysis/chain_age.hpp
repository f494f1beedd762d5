// SPDX-License-Identifier: Apache-2.0
// How old data can be when it has gone along a chain of periodic tasks under the latch rule: a job takes the newest
// messages with visible_at <= its planned release. Pure functions; any thread.
//
// The worst case is the one in which every message becomes visible as late as its task's bound allows: an earlier one
// only ever lets a later job see something newer. So the oldest data a job can see is found by walking back from its
// release, at each task to the last job whose bound has passed (compare the last-to-last age of Feiertag et al. 2008,
// here for planned instead of actual reads). Over one common period of exactly phased tasks that walk is exact; for
// tasks without known phase a message is at most one period and its bound old when it is taken.
#pragma once
#include <cstddef>
#include <vector>

#include "rt/sched/analysis/task_set.hpp"

namespace takt::analysis {

/// A task of a chain and the edge that it reads. What follows another by `on` has the releases of the head of its lane,
/// and bounds counted from there; with `every` some of them, without known phase.
struct ChainTask {
  Ticks period = 0;      ///< of the jobs that publish; the greatest distance if they are not periodic
  Ticks offset = 0;      ///< of the first release
  bool phased = true;    ///< releases are exactly offset + k * period from an epoch that all share
  Ticks visible = 0;     ///< bound: planned release to visible output (`let`: the deadline)
  bool follows = false;  ///< released by the task before it in the chain, whose very message it takes
  uint32_t depth = 1;    ///< messages that it takes of the edge from the task before it
};

struct ChainAge {
  Ticks newest =
      0;  ///< when the last output becomes visible, of data that each task took as the newest of its messages
  Ticks oldest = 0;  ///< the same if every task answers for the oldest of the `depth` messages it takes
};

/// Bound on (visible instant of the last task's output) - (planned release of the first task's job whose data it
/// holds). The first task is the device. Every job publishes; otherwise there is no bound. Needs at least one task.
ChainAge chain_age(const std::vector<ChainTask>& chain);

/// The same if each output became visible at the planned release of its job: no execution makes data younger.
Ticks least_chain_age(std::vector<ChainTask> chain);

}  // namespace takt::analysis
