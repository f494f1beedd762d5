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
  Ticks period = 0;    ///< exact distance of two releases; of a sporadic task the least distance of two arrivals
  Ticks deadline = 0;  ///< from the planned release
  Ticks budget = 0;    ///< longest execution time, overheads included
  Ticks offset = 0;    ///< of the first release; sporadic tasks have none
  Ticks jitter = 0;    ///< a job may become ready this long after its planned release
  /// Longest time it waits for something of lower priority that cannot be preempted: once in front of a busy interval
  /// that ends with its job, so what holds up those ahead of it (push-through) is in it.
  Ticks blocking = 0;
  bool sporadic = false;  ///< arrivals at any instants not closer than a period
  int priority = 0;       ///< fixed priorities: the larger wins; distinct on one core
  int core = -1;          ///< -1: any
  /// Fixed priorities: the share of somebody who waits as long as he gets it by the end of the period behind all
  /// others, and else goes before all of them.
  bool deferrable = false;
};

struct TaskSet {
  int64_t ticks_per_ns = 1;
  std::vector<TimedTask> tasks = {};
  int cores = 1;

  /// Least common multiple of the periods; nothing if it exceeds int64 (or there is no task).
  std::optional<Ticks> hyperperiod() const;
  /// Sum of budget / period.
  double utilisation() const;
};

/// Times up to this one enter an analysis; with a larger one it finds nothing. Sums of a few stay within int64.
inline constexpr Ticks kLongest = Ticks{1} << 60;

/// Why the set is no input for an analysis, in one sentence with the task's name; empty if it is one: budgets, periods
/// and deadlines positive, deadline <= period, nothing negative or above kLongest, a sporadic task without offset,
/// cores >= 1, core in [-1, cores).
std::string defect(const TaskSet& set);

/// Exact sign of (sum of budget / period) - 1: -1, 0 or 1; nothing in the one undecided case, a sum within
/// tasks / 2^60 of 1 and no hyperperiod in int64.
std::optional<int> compare_utilisation_with_one(const std::vector<TimedTask>& tasks);

/// Least common multiple of the tasks' periods (1 if there are none); nothing if it exceeds kLongest.
std::optional<Ticks> common_period(const std::vector<TimedTask>& tasks);

/// Priorities for `fixed`: the shorter deadline minus jitter wins, then the earlier task. Optimal among all
/// assignments for tasks that may be released together (Leung & Whitehead 1982; with jitter Zuhily & Burns 2007); with
/// offsets, or blocking that differs, another one may fit where this does not.
void assign_deadline_monotonic(TaskSet& set);

}  // namespace takt::analysis
