// SPDX-License-Identifier: Apache-2.0
// Small random task sets with short hyperperiods, and the patterns of arrivals that a simulation can try on them.
#pragma once
#include <algorithm>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "rt/sched/analysis/simulate.hpp"
#include "rt/sched/analysis/task_set.hpp"

namespace takt::analysis {

struct SetStyle {
  int most_tasks = 4;
  double sporadic = 0.4;  ///< share of tasks
  double jitter = 0.3;
  bool offsets = true;
  Ticks longest_period = 24;
  double least_load = 0.55;
  double tight = 0.5;  ///< share of deadlines below the period
};

inline TaskSet random_set(std::mt19937& random, const SetStyle& style = {}) {
  static const std::vector<std::vector<Ticks>> families = {{2, 3, 4, 6, 8, 12, 24}, {4, 5, 10, 20}, {3, 5, 6, 15}};
  const auto uniform = [&](Ticks low, Ticks high) { return std::uniform_int_distribution<Ticks>(low, high)(random); };
  const auto chance = [&](double p) { return std::bernoulli_distribution(p)(random); };
  for (;;) {
    TaskSet set;
    const auto& periods = families[static_cast<size_t>(uniform(0, 2))];
    const Ticks count = uniform(2, style.most_tasks);
    const double load = std::uniform_real_distribution<double>(style.least_load, 1.0)(random);
    for (Ticks i = 0; i < count; ++i) {
      TimedTask task;
      task.period = periods[static_cast<size_t>(uniform(0, static_cast<Ticks>(periods.size()) - 1))];
      const double share = load / static_cast<double>(count) * std::uniform_real_distribution<double>(0.5, 1.5)(random);
      task.budget = std::max<Ticks>(1, static_cast<Ticks>(share * static_cast<double>(task.period) + 0.5));
      if (chance(style.jitter)) task.jitter = uniform(0, task.period / 3);
      task.sporadic = !style.offsets || chance(style.sporadic);
      if (!task.sporadic) task.offset = uniform(0, task.period - 1);
      task.deadline = chance(style.tight) ? uniform(task.budget + task.jitter / 2, task.period) : task.period;
      task.core = 0;
      task.priority = static_cast<int>(count - i);  // in random order of periods
      set.tasks.push_back(task);
    }
    if (chance(0.7)) assign_deadline_monotonic(set);
    const auto common = common_period(set.tasks);
    const bool short_enough = std::all_of(set.tasks.begin(), set.tasks.end(),
                                          [&](const TimedTask& t) { return t.period <= style.longest_period; });
    if (short_enough && *compare_utilisation_with_one(set.tasks) <= 0 && *common <= 60) return set;
  }
}

/// Common period of the tasks with offsets; 1 if there are none.
inline Ticks common_period_of_fixed(const TaskSet& set) {
  Ticks common = 1;
  for (const TimedTask& task : set.tasks)
    if (!task.sporadic) common = std::lcm(common, task.period);
  return common;
}

/// When the tasks with offsets have reached their steady state, as a multiple of their common period.
inline Ticks steady_from(const TaskSet& set) {
  const Ticks common = common_period_of_fixed(set);
  Ticks latest = 0;
  for (const TimedTask& task : set.tasks) latest = std::max(latest, task.offset + task.jitter);
  return (latest + common) / common * common;
}

/// A legal pattern: nothing that can be delayed until `start` is ready before; everything as early as possible from
/// there on; sporadic tasks, silent before, arrive with `start` (`first` ticks later than they could, where given).
/// Jobs planned before `end`.
inline std::vector<std::vector<Arrival>> worst_from(const TaskSet& set, Ticks start, Ticks end,
                                                    const std::vector<Ticks>& first = {}) {
  std::vector<std::vector<Arrival>> arrivals;
  for (size_t i = 0; i < set.tasks.size(); ++i) {
    const TimedTask& task = set.tasks[i];
    arrivals.emplace_back();
    Ticks planned = task.offset;
    if (task.sporadic) planned = start - task.jitter + (first.empty() ? 0 : first[i]);
    for (; planned < end; planned += task.period) {
      const bool delayed = planned < start && planned + task.jitter >= start;
      arrivals.back().push_back({planned, delayed ? start : planned});
    }
  }
  return arrivals;
}

/// Any legal pattern: random gaps, random jitter.
inline std::vector<std::vector<Arrival>> random_arrivals(const TaskSet& set, Ticks end, std::mt19937& random) {
  const auto uniform = [&](Ticks low, Ticks high) { return std::uniform_int_distribution<Ticks>(low, high)(random); };
  std::vector<std::vector<Arrival>> arrivals;
  for (const TimedTask& task : set.tasks) {
    arrivals.emplace_back();
    Ticks planned = task.sporadic ? uniform(0, task.period) : task.offset;
    while (planned < end) {
      arrivals.back().push_back({planned, planned + uniform(0, task.jitter)});
      planned += task.period + (task.sporadic && uniform(0, 2) == 0 ? uniform(0, task.period) : 0);
    }
  }
  return arrivals;
}

inline std::string describe(const TaskSet& set) {
  std::string text;
  for (const TimedTask& task : set.tasks) {
    text += "{T " + std::to_string(task.period) + " D " + std::to_string(task.deadline) + " C " +
            std::to_string(task.budget) + " O " + std::to_string(task.offset) + " J " + std::to_string(task.jitter) +
            " B " + std::to_string(task.blocking) + (task.sporadic ? " sporadic" : "") + " p " +
            std::to_string(task.priority) + "} ";
  }
  return text;
}

}  // namespace takt::analysis
