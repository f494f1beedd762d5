// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/analysis/partition.hpp"

#include "sets.hpp"

using namespace takt::analysis;

namespace {

std::vector<int> cores_of(const TaskSet& set) {
  std::vector<int> cores;
  for (const TimedTask& task : set.tasks) cores.push_back(task.core);
  return cores;
}

TaskSet set_of(std::vector<TimedTask> tasks) {
  TaskSet set;
  set.tasks = std::move(tasks);
  return set;
}

}  // namespace

TEST_CASE("by decreasing density, on the core with the least work") {
  const Partition found =
      partition(set_of(tasks_of({{2, 10, 10}, {6, 10, 10}, {5, 10, 10}, {3, 10, 10}})), 2, CorePolicy::edf);
  CHECK(found.verdict == Verdict::schedulable);
  CHECK(cores_of(found.set) == std::vector<int>{0, 0, 1, 1});  // 6, 5, then 3 beside 5, then 2
  CHECK(found.set.cores == 2);
  CHECK(found.why.empty());
}

TEST_CASE("where that fails, first fit is tried") {
  // 6 + 3 and 4 + 4, and the last 3 fits nowhere
  const auto tasks = tasks_of({{6, 10, 10}, {4, 10, 10}, {4, 10, 10}, {3, 10, 10}, {3, 10, 10}});
  const Partition found = partition(set_of(tasks), 2, CorePolicy::edf);
  CHECK(found.verdict == Verdict::schedulable);
  CHECK(cores_of(found.set) == std::vector<int>{0, 0, 1, 1, 1});
}

TEST_CASE("where both fail, all assignments are tried") {
  // by work: 5 + 2 + 2 and 4 + 3 + 2, and the last 2 fits nowhere; first fit: 5 + 4 and 3 + 2 + 2 + 2; 5 + 3 + 2 does
  const auto tasks =
      tasks_of({{5, 10, 10}, {4, 10, 10}, {3, 10, 10}, {2, 10, 10}, {2, 10, 10}, {2, 10, 10}, {2, 10, 10}});
  const Partition found = partition(set_of(tasks), 2, CorePolicy::edf);
  CHECK(found.verdict == Verdict::schedulable);
  CHECK(found.set.tasks[0].core == found.set.tasks[2].core);
  CHECK(analyse(found.set, CorePolicy::edf).verdict == Verdict::schedulable);
}

TEST_CASE("given cores stay; with them the rest may fit no more") {
  auto tasks = tasks_of({{6, 10, 10}, {6, 10, 10}, {4, 10, 10}});
  tasks[2].core = 1;
  TaskSet set = set_of(tasks);
  const Partition found = partition(set, 2, CorePolicy::edf);
  CHECK(found.verdict == Verdict::schedulable);
  CHECK(cores_of(found.set) == std::vector<int>{0, 1, 1});
  set.tasks[1].core = 0;
  set.tasks[0].core = 0;
  const Partition none = partition(set, 2, CorePolicy::edf);
  CHECK(none.verdict == Verdict::not_schedulable);
  CHECK(none.why == "the tasks with a given core do not fit on it");
}

TEST_CASE("no assignment: said so, with the task that fits nowhere") {
  const Partition found =
      partition(set_of(tasks_of({{6, 10, 10}, {6, 10, 10}, {6, 10, 10}})), 2, CorePolicy::fixed_priority);
  CHECK(found.verdict == Verdict::not_schedulable);
  CHECK(found.why == "task 'c' fits on no core beside those of higher density, and no other assignment fits");
  CHECK(cores_of(found.set) == std::vector<int>{-1, -1, -1});
}

TEST_CASE("bad input is not proven") {
  CHECK(partition(set_of(tasks_of({{0, 10, 10}})), 2, CorePolicy::edf).why == "task 'a': the budget is not above 0");
  CHECK(partition(set_of(tasks_of({{1, 10, 10}})), 0, CorePolicy::edf).verdict == Verdict::not_proven);
}
