// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/analysis/task_set.hpp"

#include <limits>

#include "sets.hpp"

using namespace takt::analysis;

namespace {

TaskSet one_task() {
  TaskSet set;
  set.tasks = tasks_of({{2, 8, 10}});
  return set;
}

}  // namespace

TEST_CASE("the hyperperiod of 15, 10, 7, 5 and 2 Hz is one second with 39 releases") {
  TaskSet set;
  set.ticks_per_ns = 21;  // makes 1/15 s and 1/7 s whole
  for (const Ticks rate : {15, 10, 7, 5, 2}) {
    TimedTask task;
    task.period = task.deadline = 21'000'000'000 / rate;
    CHECK(task.period * rate == 21'000'000'000);
    task.budget = 1;
    set.tasks.push_back(task);
  }
  REQUIRE(set.hyperperiod() == 21'000'000'000);
  Ticks releases = 0;
  for (const TimedTask& task : set.tasks) releases += *set.hyperperiod() / task.period;
  CHECK(releases == 39);
}

TEST_CASE("a hyperperiod beyond int64 is nothing") {
  TaskSet set;
  CHECK_FALSE(set.hyperperiod().has_value());
  set.tasks = tasks_of({{1, 1'000'000'007, 1'000'000'007}, {1, 998'244'353, 998'244'353}});
  CHECK(set.hyperperiod() == 1'000'000'007LL * 998'244'353);
  set.tasks.push_back(tasks_of({{1, 999'999'937, 999'999'937}}).front());
  CHECK_FALSE(set.hyperperiod().has_value());
}

TEST_CASE("utilisation is compared with 1 exactly") {
  CHECK(compare_utilisation_with_one(tasks_of({{1, 3, 3}, {1, 3, 3}, {1, 3, 3}})) == 0);
  CHECK(compare_utilisation_with_one(tasks_of({{1, 3, 3}, {2, 3, 3}, {1, 99, 99}})) == 1);
  const Ticks big = kLongest;
  CHECK(compare_utilisation_with_one(tasks_of({{big / 2 - 1, big, big}, {big / 2, big, big}})) == -1);
  CHECK(compare_utilisation_with_one({}) == -1);
  // a hair above 1, and no common period in range: undecided
  CHECK_FALSE(compare_utilisation_with_one(tasks_of({{1, 3, 3}, {2, 3, 3}, {1, big, big}})).has_value());
  CHECK(compare_utilisation_with_one(tasks_of({{1, 3, 3}, {2, 3, 3}, {9, big, big}})) == 1);
}

TEST_CASE("a defect names the task") {
  TaskSet set = one_task();
  CHECK(defect(set).empty());
  const auto defect_with = [](auto change) {
    TaskSet broken = one_task();
    change(broken);
    return defect(broken);
  };
  CHECK(defect_with([](TaskSet& s) { s.tasks[0].budget = 0; }) == "task 'a': the budget is not above 0");
  CHECK(defect_with([](TaskSet& s) { s.tasks[0].period = 0; }) == "task 'a': the period is not above 0");
  CHECK(defect_with([](TaskSet& s) { s.tasks[0].deadline = 0; }) == "task 'a': the deadline is not above 0");
  CHECK(defect_with([](TaskSet& s) { s.tasks[0].deadline = 11; }) == "task 'a': the deadline is above the period");
  CHECK(defect_with([](TaskSet& s) { s.tasks[0].offset = 1; }) == "task 'a': a sporadic task has no offset");
  CHECK(defect_with([](TaskSet& s) { s.tasks[0].jitter = -1; }) == "task 'a': a time is negative");
  CHECK(defect_with([](TaskSet& s) { s.tasks[0].blocking = kLongest + 1; }) ==
        "task 'a': a time is too long for an analysis");
  CHECK(defect_with([](TaskSet& s) { s.tasks[0].core = 1; }) == "task 'a': the core does not exist");
  CHECK(defect_with([](TaskSet& s) { s.cores = 0; }) == "there is no core");
}

TEST_CASE("deadline monotonic: the deadline that is left after the jitter counts") {
  TaskSet set;
  set.tasks = tasks_of({{1, 9, 10}, {1, 8, 10}, {1, 9, 10, 0, 3}, {1, 9, 10}});
  assign_deadline_monotonic(set);
  const auto priority = [&](size_t i) { return set.tasks[i].priority; };
  CHECK(priority(2) > priority(1));
  CHECK(priority(1) > priority(0));
  CHECK(priority(0) > priority(3));
}
