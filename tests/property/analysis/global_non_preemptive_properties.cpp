// SPDX-License-Identifier: Apache-2.0
// Non-preemptive EDF of several workers: what is called schedulable misses nothing in simulation, whatever the
// execution times up to the budgets, and no response exceeds its bound.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstdio>

#include "random.hpp"
#include "rt/sched/analysis/global_non_preemptive.hpp"
#include "tests/property_scale.hpp"

using namespace takt::analysis;

namespace {

enum class Lengths { full, random, none_or_full };

/// The cooperative queue, job by job; returns the longest response of each task.
std::vector<Ticks> simulate(const TaskSet& set, Ticks end, Lengths lengths, Random& random) {
  struct Job {
    size_t task;
    Ticks release, ready, deadline;
  };
  std::vector<Job> waiting;
  for (size_t t = 0; t < set.tasks.size(); ++t)
    for (Ticks at = set.tasks[t].offset; at < end; at += set.tasks[t].period)
      waiting.push_back({t, at, at + random.uniform(0, set.tasks[t].jitter), at + set.tasks[t].deadline});
  std::vector<Ticks> free(static_cast<size_t>(set.cores), 0), response(set.tasks.size(), 0);
  while (!waiting.empty()) {
    const auto worker = std::min_element(free.begin(), free.end());
    Ticks now = INT64_MAX;
    for (const Job& job : waiting) now = std::min(now, job.ready);
    now = std::max(now, *worker);
    auto best = waiting.end();
    for (auto job = waiting.begin(); job != waiting.end(); ++job) {
      if (job->ready > now) continue;
      if (best == waiting.end() || job->deadline < best->deadline ||
          (job->deadline == best->deadline && job->task < best->task))
        best = job;
    }
    const Ticks budget = set.tasks[best->task].budget;
    const Ticks took = lengths == Lengths::full     ? budget
                       : lengths == Lengths::random ? random.uniform(0, budget)
                                                    : budget * random.uniform(0, 1);
    *worker = now + took;
    response[best->task] = std::max(response[best->task], *worker - best->release);
    waiting.erase(best);
  }
  return response;
}

TaskSet random_cooperative_set(Random& random) {
  constexpr Ticks kPeriods[] = {6, 10, 15, 30, 60};
  TaskSet set;
  set.cores = static_cast<int>(random.uniform(1, 3));
  const Ticks count = random.uniform(set.cores, 3 * set.cores + 2);
  for (Ticks i = 0; i < count; ++i) {
    TimedTask task;
    task.name = std::to_string(i);
    task.period = kPeriods[random.uniform(0, 4)];
    task.budget = std::max<Ticks>(1, task.period * random.uniform(2, 35) / 100);
    task.deadline = random.uniform(std::min(2 * task.budget, task.period), task.period);
    task.offset = random.uniform(0, 2) == 0 ? 0 : random.uniform(0, task.period);
    task.jitter = random.uniform(0, 3) == 0 ? random.uniform(0, 2) : 0;
    set.tasks.push_back(task);
  }
  return set;
}

TimedTask task(Ticks budget, Ticks deadline, Ticks period, Ticks offset) {
  TimedTask t;
  t.name = "t";
  t.budget = budget;
  t.deadline = deadline;
  t.period = period;
  t.offset = offset;
  return t;
}

}  // namespace

TEST_CASE("cooperative workers: what is called schedulable misses nothing, and no response exceeds its bound") {
  Random random{std::mt19937(takt::test::seed(40))};
  int accepted = 0, fine = 0, reached = 0, tasks = 0;
  for (int round = 0; round < takt::test::rounds(10'000); ++round) {
    CAPTURE(round);
    const TaskSet set = random_cooperative_set(random);
    const CoreAnalysis answer = global_non_preemptive_edf(set, 5'000);
    const bool schedulable = answer.verdict == Verdict::schedulable;
    accepted += schedulable;
    bool missed = false;
    std::vector<Ticks> longest(set.tasks.size(), 0);
    for (int run = 0; run < (schedulable ? 12 : 6); ++run) {
      const std::vector<Ticks> seen = simulate(set, 300, static_cast<Lengths>(run % 3), random);
      for (size_t t = 0; t < set.tasks.size(); ++t) {
        longest[t] = std::max(longest[t], seen[t]);
        missed = missed || seen[t] > set.tasks[t].deadline;
        if (schedulable) REQUIRE(seen[t] <= *answer.responses.bounds[t]);
      }
    }
    if (schedulable) REQUIRE(!missed);
    fine += !missed;
    for (size_t t = 0; schedulable && t < set.tasks.size(); ++t, ++tasks)
      reached += longest[t] == *answer.responses.bounds[t];
  }
  std::printf("cooperative workers: %d of 10000 sets accepted, %d not refuted; bound reached by %.0f %% of the tasks\n",
              accepted, fine, 100.0 * reached / tasks);
  CHECK(accepted >= takt::test::at_scale(1'500));
}

TEST_CASE("cooperative workers: phases decide") {
  TaskSet set;
  set.cores = 1;
  set.tasks = {task(2, 3, 10, 5), task(5, 10, 10, 0)};  // the long one is through when the short one comes
  CHECK(global_non_preemptive_edf(set).verdict == Verdict::schedulable);
  set.tasks[1].offset = 1;
  CHECK(global_non_preemptive_edf(set).verdict == Verdict::schedulable);
  set.tasks[1].offset = 2;  // in its way until 7: late at 9
  CHECK(global_non_preemptive_edf(set).why == "task 't' may be late");
  set.cores = 2;
  CHECK(global_non_preemptive_edf(set).verdict == Verdict::schedulable);
  set.tasks[0].sporadic = true;
  set.tasks[0].offset = 0;
  CHECK(global_non_preemptive_edf(set).verdict == Verdict::not_proven);
}

TEST_CASE("cooperative workers: an early end may make another job late, which is seen") {
  // If the first job of all ends at once, the long one starts before the short one is there.
  TaskSet set;
  set.cores = 1;
  set.tasks = {task(3, 6, 20, 0), task(2, 4, 20, 2), task(10, 19, 20, 1)};
  CHECK(global_non_preemptive_edf(set).verdict == Verdict::not_proven);
}
