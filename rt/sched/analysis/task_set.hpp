// SPDX-License-Identifier: Apache-2.0
// What the schedulability analyses work on: a set of tasks with whole numbers of ticks. A period such as 1/15 s is no
// whole number of nanoseconds; a tick is a nanosecond divided by as much as makes every period whole, so that all
// analyses are exact. Plain data; any thread.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace takt::analysis {

/// Time in ticks of the set it belongs to.
using Ticks = int64_t;

/// One task as an analysis sees it. Constrained deadlines: 0 < deadline <= period.
struct TimedTask {
  std::string name = {};
  Ticks period = 0;       ///< exact distance of two releases; of a sporadic task the least distance of two arrivals
  Ticks deadline = 0;     ///< from the planned release
  Ticks budget = 0;       ///< longest execution time, overheads included
  Ticks offset = 0;       ///< of the first release; sporadic tasks have none
  Ticks jitter = 0;       ///< a job may become ready this long after its planned release
  Ticks blocking = 0;     ///< longest time it waits for something of lower priority that cannot be preempted
  bool sporadic = false;  ///< arrivals at any instants not closer than a period
  int priority = 0;       ///< fixed priorities: the larger wins; distinct on one core
  int core = -1;          ///< -1: any
};

struct TaskSet {
  int64_t ticks_per_ns = 1;
  std::vector<TimedTask> tasks = {};
  int cores = 1;

  /// Least common multiple of the periods; nothing if it exceeds int64.
  std::optional<Ticks> hyperperiod() const;
  /// Sum of budget / period.
  double utilisation() const;
};

}  // namespace takt::analysis
