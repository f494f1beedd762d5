// SPDX-License-Identifier: Apache-2.0
// The analyses of a set whose tasks are bound to cores: each core by itself. What the three policies have in common:
// words of the answer, and one entry for all of them. Pure functions; any thread.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "rt/sched/analysis/task_set.hpp"

namespace takt::analysis {

/// How one core chooses among its jobs.
enum class CorePolicy : uint8_t {
  fixed_priority,     ///< preemptive, TimedTask::priority
  edf,                ///< preemptive, earliest absolute deadline first
  non_preemptive_edf  ///< a job that has started finishes
};

enum class Verdict : uint8_t {
  schedulable,      ///< no job ever misses its deadline
  not_schedulable,  ///< some legal pattern of arrivals makes a job miss
  not_proven        ///< the analysis cannot tell (a sufficient test failed, or figures beyond its range)
};

/// Longest time from a job's planned release to its finish, per task in the order of the tasks.
struct ResponseBounds {
  /// Nothing: unbounded (utilisation above 1), or beyond the analysis' range.
  std::vector<std::optional<Ticks>> bounds = {};
  /// Each bound is attained by some legal pattern of arrivals; otherwise bounds only.
  bool exact = true;
};

/// Some interval in which more has to be done than there is time: `demand` (blocking included) > `length`.
struct Overload {
  Ticks start = 0;  ///< phase within the hyperperiod of the tasks with offsets; 0 if there are none
  Ticks length = 0;
  Ticks demand = 0;
};

struct DemandAnswer {
  Verdict verdict = Verdict::not_proven;
  std::optional<Overload> overload = {};  ///< where found; a utilisation above 1 needs none
};

struct CoreAnalysis {
  Verdict verdict = Verdict::not_proven;
  ResponseBounds responses = {};
  std::string why = {};  ///< one sentence naming task or interval, empty if schedulable
};

/// What the deadlines say of response bounds of the same tasks.
Verdict verdict_of(const std::vector<TimedTask>& tasks, const ResponseBounds& responses);

/// The verdict alone, of tasks that share one core: without responses where the policy does not need them.
Verdict core_verdict(const std::vector<TimedTask>& tasks, CorePolicy policy);

/// Every core by itself with its policy; bounds in the order of the set. A task without core counts as on core 0 of a
/// set with one core. A set with a `defect` or an unbound task among several cores: not proven, `why` names it.
CoreAnalysis analyse(const TaskSet& set, CorePolicy policy);

}  // namespace takt::analysis
