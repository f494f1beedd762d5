// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "rt/sched/analysis/task_set.hpp"

using namespace takt::analysis;

TEST_CASE("hyperperiod of 15, 10, 7, 5 and 2 Hz is one second") {
  // ticks of 1/21 ns make 1/15 s and 1/7 s whole
  TaskSet set;
  set.ticks_per_ns = 21;
  for (const Ticks rate : {15, 10, 7, 5, 2}) {
    TimedTask task;
    task.period = task.deadline = 21'000'000'000 / rate;
    task.budget = 1;
    set.tasks.push_back(task);
  }
  CHECK(set.hyperperiod() == 21'000'000'000);
  CHECK(defect(set).empty());
}
