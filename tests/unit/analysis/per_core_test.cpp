// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/analysis/per_core.hpp"

#include "rt/sched/analysis/edf.hpp"
#include "rt/sched/analysis/fixed_priority.hpp"
#include "sets.hpp"

using namespace takt::analysis;

namespace {

constexpr CorePolicy kPolicies[] = {CorePolicy::fixed_priority, CorePolicy::edf, CorePolicy::non_preemptive_edf};

}

TEST_CASE("each core by itself: responses in the order of the set, the verdict of the worst core") {
  TaskSet set;
  set.cores = 2;
  set.tasks = tasks_of({{3, 7, 7}, {9, 10, 10}, {3, 12, 12}});
  set.tasks[0].core = set.tasks[2].core = 1;
  set.tasks[1].core = 0;
  for (const CorePolicy policy : {CorePolicy::fixed_priority, CorePolicy::edf}) {
    const CoreAnalysis found = analyse(set, policy);
    CHECK(found.verdict == Verdict::schedulable);
    CHECK(found.responses.bounds == Bounds{3, 9, 6});
    CHECK(found.responses.exact);
    CHECK(found.why.empty());
  }
  set.tasks[1].jitter = 2;
  const CoreAnalysis late = analyse(set, CorePolicy::edf);
  CHECK(late.verdict == Verdict::not_schedulable);
  CHECK(late.why == "task 'b': response 11 above its deadline 10");
}

TEST_CASE("a set that is no input is not proven, and says why") {
  TaskSet set;
  set.cores = 2;
  set.tasks = tasks_of({{1, 2, 2}});
  for (const CorePolicy policy : kPolicies) {
    CHECK(analyse(set, policy).verdict == Verdict::not_proven);
    CHECK(analyse(set, policy).why == "task 'a' has no core");
    CHECK(analyse(set, policy).responses.bounds == Bounds{std::nullopt});
  }
}

TEST_CASE("a utilisation above 1 is not schedulable, and no task but those ahead has a bound") {
  TaskSet set;
  set.tasks = tasks_of({{2, 4, 4}, {3, 5, 5}});
  for (const CorePolicy policy : kPolicies) CHECK(analyse(set, policy).verdict == Verdict::not_schedulable);
  CHECK(analyse(set, CorePolicy::fixed_priority).responses.bounds == Bounds{2, std::nullopt});
  CHECK(analyse(set, CorePolicy::edf).responses.bounds == Bounds{std::nullopt, std::nullopt});
}

TEST_CASE("a utilisation of exactly 1 with jitter is never idle, and still has bounds") {
  TaskSet set;
  set.tasks = tasks_of({{2, 4, 4}, {3, 6, 6, 0, 2}});
  const CoreAnalysis found = analyse(set, CorePolicy::fixed_priority);
  CHECK(found.responses.bounds == Bounds{2, 9});
  CHECK(found.verdict == Verdict::not_schedulable);
}

TEST_CASE("figures at the end of the range are refused, not wrapped") {
  const Ticks p = kLongest - 1, q = kLongest - 3;  // a hyperperiod beyond 2^64
  TaskSet set;
  set.tasks = tasks_of({{p / 2, p, p, 5, 7}, {q / 3, q, q}}, false);
  for (const CorePolicy policy : kPolicies) {
    const CoreAnalysis found = analyse(set, policy);
    CHECK_FALSE(found.responses.exact);  // offsets forgotten
    for (const auto& bound : found.responses.bounds) CHECK((!bound || (*bound > 0 && *bound <= 2 * kLongest)));
  }
  // A busy interval far too long to walk through in steps of the effort allowed: no bound, no verdict.
  set.tasks = tasks_of({{p / 2, p, p}, {1, 3, 3}, {1, 7, 7}});
  for (const CorePolicy policy : kPolicies) {
    const CoreAnalysis found = analyse(set, policy);
    for (const auto& bound : found.responses.bounds) CHECK((!bound || *bound > 0));
  }
}

TEST_CASE("a busy interval that holds a million million releases ends the analysis, not the memory") {
  const Ticks long_period = 1'000'000'000'000'000;
  auto tasks = tasks_of({{500, 1000, 1000, 1}, {499, 1000, 1000, 7}}, false);
  tasks.push_back(tasks_of({{long_period / 1011, long_period, long_period}}).front());
  tasks.back().priority = -9;
  const ResponseBounds found = edf_responses(tasks);
  CHECK_FALSE(found.exact);
  CHECK(fixed_priority_responses(tasks).bounds[0] == 500);
}

TEST_CASE("the rates of the robot on one core, in exact ticks") {
  TaskSet set;
  set.ticks_per_ns = 21;
  const Ticks ms = 21'000'000, second = 1000 * ms;
  for (const auto& [rate, budget] :
       std::vector<std::pair<Ticks, Ticks>>{{15, 12}, {10, 15}, {7, 20}, {5, 10}, {2, 120}}) {
    TimedTask task;
    task.name = std::to_string(rate) + " Hz";
    task.period = task.deadline = second / rate;
    task.budget = budget * ms;
    set.tasks.push_back(task);
  }
  assign_deadline_monotonic(set);
  const CoreAnalysis fixed = analyse(set, CorePolicy::fixed_priority), edf = analyse(set, CorePolicy::edf);
  CHECK(fixed.verdict == Verdict::schedulable);
  CHECK(edf.verdict == Verdict::schedulable);
  CHECK(analyse(set, CorePolicy::non_preemptive_edf).verdict == Verdict::not_proven);  // 120 ms in front of 66.7
  // 12 + 15 + 20 + 10 + 120 and what comes in meanwhile: more of each but the 5 Hz
  CHECK(fixed.responses.bounds[0] == 12 * ms);
  CHECK(fixed.responses.bounds[1] == 27 * ms);
  CHECK(fixed.responses.bounds[2] == 47 * ms);
  CHECK(fixed.responses.bounds[3] == 57 * ms);
}

TEST_CASE("a deferrable share waits where that gets it done, and else goes before all") {
  const auto bounds = [](Ticks period, Ticks budget, Row row) {
    std::vector<TimedTask> tasks = tasks_of({row, {budget, period, period}});
    tasks[1].deferrable = true;
    return fixed_priority_responses(tasks);
  };
  ResponseBounds found = bounds(10, 3, {6, 10, 10});
  CHECK(found.bounds == Bounds{6, 9});
  CHECK(found.exact);
  CHECK(bounds(10, 4, {6, 10, 10}).bounds == Bounds{6, 10});
  // 12 and then 4 is past 15: 4, which may have waited until 11, 4 at once of the next period, and 4 when that has
  // waited no more.
  found = bounds(15, 4, {12, 30, 30});
  CHECK(found.bounds[0] == 24);
  CHECK(!found.exact);
  CHECK(verdict_of(tasks_of({{12, 20, 30}, {4, 15, 15}}), found) == Verdict::not_proven);
}
