// SPDX-License-Identifier: Apache-2.0
// Partitioning against all assignments, one after another.
#include <doctest/doctest.h>

#include "random_sets.hpp"
#include "rt/sched/analysis/partition.hpp"
#include "tests/property_scale.hpp"

namespace {

using namespace takt::analysis;

bool any_assignment(TaskSet set, CorePolicy policy) {
  const size_t count = set.tasks.size();
  const std::vector<TimedTask> given = set.tasks;
  for (size_t code = 0; code < (size_t{1} << count); ++code) {
    bool keeps = true;
    for (size_t i = 0; i < count; ++i) {
      set.tasks[i].core = static_cast<int>(code >> i & 1);
      keeps = keeps && (given[i].core < 0 || given[i].core == set.tasks[i].core);
    }
    if (keeps && analyse(set, policy).verdict == Verdict::schedulable) return true;
  }
  return false;
}

}  // namespace

TEST_CASE("partitioning finds an assignment to two cores exactly if there is one") {
  std::mt19937 random(takt::test::seed(21));
  int found = 0, none = 0;
  for (int n = 0; n < takt::test::rounds(600); ++n) {
    TaskSet set;
    set.cores = 2;
    while (set.tasks.size() < 5) {
      for (TimedTask& task : random_set(random, {.longest_period = 12, .least_load = 0.8, .tight = 0.8}).tasks) {
        task.core = random() % 5 == 0 ? static_cast<int>(random() % 2) : -1;
        set.tasks.push_back(task);
      }
    }
    assign_deadline_monotonic(set);
    const CorePolicy policy = n % 2 ? CorePolicy::edf : CorePolicy::fixed_priority;
    CAPTURE(describe(set));
    const Partition answer = partition(set, 2, policy);
    const bool exists = any_assignment(set, policy);
    REQUIRE(answer.verdict == (exists ? Verdict::schedulable : Verdict::not_schedulable));
    ++(exists ? found : none);
    if (!exists) continue;
    REQUIRE(analyse(answer.set, policy).verdict == Verdict::schedulable);
    for (size_t i = 0; i < set.tasks.size(); ++i) {
      if (set.tasks[i].core >= 0) REQUIRE(answer.set.tasks[i].core == set.tasks[i].core);
    }
  }
  MESSAGE("partitioning: " << found << " found, " << none << " without any");
  CHECK(found >= takt::test::at_scale(90));
  CHECK(none >= takt::test::at_scale(90));
}
