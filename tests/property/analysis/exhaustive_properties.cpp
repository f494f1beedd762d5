// SPDX-License-Identifier: Apache-2.0
// Verdicts and worst responses against everything that can happen (adversary.hpp), on tiny sets.
#include <doctest/doctest.h>

#include "adversary.hpp"
#include "random_sets.hpp"
#include "rt/sched/analysis/edf.hpp"
#include "rt/sched/analysis/per_core.hpp"
#include "tests/property_scale.hpp"

namespace {

using namespace takt::analysis;

struct Tally {
  int schedulable = 0, not_schedulable = 0, not_proven = 0;
  size_t states = 0;
};

/// `exact`: an equivalence is expected, in verdict and responses; else only soundness.
void compare(uint64_t seed, int sets, const SetStyle& style, CorePolicy policy, Dispatch dispatch, bool exact) {
  std::mt19937 random(takt::test::seed(seed));
  Tally tally;
  for (int n = 0; n < takt::test::rounds(sets); ++n) {
    const TaskSet set = random_set(random, style);
    CAPTURE(describe(set));
    const Adversary all(set.tasks, dispatch);
    const CoreAnalysis found = analyse(set, policy);
    tally.states += all.states();
    ++(all.late ? tally.not_schedulable : tally.schedulable);
    if (!all.late && found.verdict != Verdict::schedulable) ++tally.not_proven;
    if (exact) REQUIRE(found.verdict == (all.late ? Verdict::not_schedulable : Verdict::schedulable));
    if (all.late) {
      REQUIRE(found.verdict != Verdict::schedulable);
      continue;
    }
    for (size_t i = 0; i < set.tasks.size(); ++i) {
      CAPTURE(i);
      REQUIRE(found.responses.bounds[i].has_value());
      REQUIRE(*found.responses.bounds[i] >= all.longest[i]);
      if (exact) REQUIRE(*found.responses.bounds[i] == all.longest[i]);
    }
  }
  MESSAGE(tally.schedulable << " schedulable (" << tally.not_proven << " of them not proven), " << tally.not_schedulable
                            << " not; " << tally.states << " states");
  CHECK(tally.schedulable > 0.15 * takt::test::rounds(sets));
  CHECK(tally.not_schedulable > 0.15 * takt::test::rounds(sets));
}

const SetStyle kTiny{.most_tasks = 3, .longest_period = 12, .least_load = 0.65, .tight = 0.8};

}  // namespace

TEST_CASE("fixed priorities against everything that can happen") {
  compare(11, 10'000, kTiny, CorePolicy::fixed_priority, Dispatch::fixed_priority, true);
}

TEST_CASE("EDF against everything that can happen") {
  compare(12, 10'000, kTiny, CorePolicy::edf, Dispatch::edf, true);
}

TEST_CASE("non-preemptive EDF of sporadic tasks against everything that can happen") {
  SetStyle style = kTiny;
  style.offsets = false;
  compare(13, 10'000, style, CorePolicy::non_preemptive_edf, Dispatch::non_preemptive_edf, true);
}

TEST_CASE("non-preemptive EDF with offsets: sound against everything that can happen") {
  compare(14, 10'000, kTiny, CorePolicy::non_preemptive_edf, Dispatch::non_preemptive_edf, false);
}

namespace {

/// Bounds under blocking, task by task: each task's own blocking is what the others do not see.
void compare_blocking(uint64_t seed, int sets, CorePolicy policy, Dispatch dispatch) {
  std::mt19937 random(takt::test::seed(seed));
  int bounds = 0, unscheduled = 0, not_compared = 0;
  for (int n = 0; n < takt::test::rounds(sets); ++n) {
    TaskSet set = random_set(random, kTiny);
    for (TimedTask& task : set.tasks) task.blocking = std::uniform_int_distribution<Ticks>(0, task.period / 3)(random);
    CAPTURE(describe(set));
    const CoreAnalysis found = analyse(set, policy);
    bool late = false, clear = true;
    for (size_t i = 0; i < set.tasks.size(); ++i) {
      CAPTURE(i);
      const Adversary all(set.tasks, dispatch, i);
      late = late || all.late;
      clear = clear && !all.disturbed;
      if (all.late || all.disturbed) continue;
      ++bounds;
      REQUIRE(found.responses.bounds[i].has_value());
      REQUIRE(*found.responses.bounds[i] == all.longest[i]);
    }
    unscheduled += late;
    if (late) REQUIRE(found.verdict == Verdict::not_schedulable);
    if (!late && clear) REQUIRE(found.verdict == Verdict::schedulable);
    not_compared += !late && !clear;
    if (policy == CorePolicy::edf) REQUIRE(edf_demand_test(set.tasks).verdict == found.verdict);
  }
  MESSAGE(bounds << " bounds attained; " << unscheduled << " sets not schedulable, " << not_compared
                 << " not compared");
  CHECK(bounds > 0);  // the property must not hold for want of sets
}

}  // namespace

TEST_CASE("fixed priorities with blocking against everything that can happen") {
  compare_blocking(15, 4'000, CorePolicy::fixed_priority, Dispatch::fixed_priority);
}

TEST_CASE("EDF with blocking against everything that can happen") {
  compare_blocking(16, 150, CorePolicy::edf, Dispatch::edf);
}
