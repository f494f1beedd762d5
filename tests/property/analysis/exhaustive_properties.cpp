// SPDX-License-Identifier: Apache-2.0
// Verdicts and worst responses against everything that can happen (adversary.hpp), on tiny sets.
#include <doctest/doctest.h>

#include "adversary.hpp"
#include "random_sets.hpp"
#include "rt/sched/analysis/per_core.hpp"

namespace {

using namespace takt::analysis;

struct Tally {
  int schedulable = 0, not_schedulable = 0, not_proven = 0;
  size_t states = 0;
};

/// `exact`: an equivalence is expected, in verdict and responses; else only soundness.
Tally compare(uint32_t seed, int sets, const SetStyle& style, CorePolicy policy, Dispatch dispatch, bool exact) {
  std::mt19937 random(seed);
  Tally tally;
  for (int n = 0; n < sets; ++n) {
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
  CHECK(tally.schedulable > 0.15 * sets);
  CHECK(tally.not_schedulable > 0.15 * sets);
  return tally;
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
