// SPDX-License-Identifier: Apache-2.0
// Task sets as the literature prints them.
#pragma once
#include <doctest/doctest.h>

#include <algorithm>
#include <initializer_list>
#include <optional>
#include <string>
#include <vector>

#include "rt/sched/analysis/per_core.hpp"

namespace takt::analysis {

struct Row {
  Ticks budget, deadline, period, offset = 0, jitter = 0;
};

/// All `sporadic`, or none of them (only then may a row have an offset); the first row has the highest priority.
inline std::vector<TimedTask> tasks_of(std::initializer_list<Row> rows, bool sporadic = true) {
  std::vector<TimedTask> tasks;
  for (const Row& row : rows) {
    TimedTask task;
    task.name = std::string(1, static_cast<char>('a' + tasks.size()));
    task.budget = row.budget;
    task.deadline = row.deadline;
    task.period = row.period;
    task.offset = row.offset;
    task.jitter = row.jitter;
    task.sporadic = sporadic;
    task.priority = -static_cast<int>(tasks.size());
    tasks.push_back(task);
  }
  return tasks;
}

using Bounds = std::vector<std::optional<Ticks>>;

}  // namespace takt::analysis
