// SPDX-License-Identifier: Apache-2.0
// Bounds of pieces of a job, what it begins with and what it goes on with, against simulation: no pattern of arrivals
// and no execution time of the rest gets beyond them.
#include <doctest/doctest.h>

#include <algorithm>
#include <map>
#include <random>

#include "random_sets.hpp"
#include "rt/sched/analysis/continuation.hpp"
#include "rt/sched/analysis/edf.hpp"
#include "rt/sched/analysis/fixed_priority.hpp"
#include "tests/property_scale.hpp"

namespace {

using namespace takt::analysis;

/// A task's job as two pieces: `first` at most, then `rest`.
struct Split {
  size_t task;
  Ticks first, rest;
};

struct Longest {
  Ticks first = 0, rest = 0;
};

/// One schedule, with jobs of the split task whose first piece is short, long or anything.
void play(const TaskSet& set, Dispatch dispatch, const Split& split, std::mt19937& random,
          const std::vector<std::vector<Arrival>>& arrivals, Longest& longest) {
  struct Progress {
    Ticks first = 0, done = 0, since = 0;
  };
  std::map<int64_t, Progress> jobs;
  SimulationHooks hooks;
  hooks.duration = [&](const SimulatedJob& job) {
    const auto any = [&](Ticks most) { return std::uniform_int_distribution<Ticks>(1, most)(random); };
    if (job.task != split.task) return random() % 2 ? set.tasks[job.task].budget : any(set.tasks[job.task].budget);
    return (jobs[job.number].first = random() % 2 ? split.first : any(split.first)) + split.rest;
  };
  hooks.ran = [&](const SimulatedJob& job, Ticks from, Ticks to) {
    if (job.task != split.task) return;
    Progress& progress = jobs[job.number];
    const Ticks before = progress.done;
    progress.done += to - from;
    if (before < progress.first && progress.done >= progress.first) {
      progress.since = from + progress.first - before;
      longest.first = std::max(longest.first, progress.since - job.planned);
    }
    if (progress.done == progress.first + split.rest) longest.rest = std::max(longest.rest, to - progress.since);
  };
  simulate(set, dispatch, arrivals, hooks);
}

Longest play_many(const TaskSet& set, Dispatch dispatch, const Split& split, std::mt19937& random) {
  Longest longest;
  const Ticks steady = steady_from(set), common = *common_period(set.tasks);
  for (Ticks start = steady; start < steady + common_period_of_fixed(set); ++start)
    play(set, dispatch, split, random, worst_from(set, start, start + 2 * common + 24), longest);
  for (int n = 0; n < 4; ++n) play(set, dispatch, split, random, random_arrivals(set, 100, random), longest);
  return longest;
}

void compare(uint64_t seed, int sets, CorePolicy policy, Dispatch dispatch) {
  std::mt19937 random(takt::test::seed(seed));
  int compared = 0, attained_first = 0, attained_rest = 0;
  while (compared < takt::test::rounds(sets)) {
    const TaskSet set = random_set(random);
    const CoreAnalysis whole = analyse(set, policy);
    const size_t task = random() % set.tasks.size();
    const Ticks budget = set.tasks[task].budget;
    if (whole.verdict != Verdict::schedulable || budget < 2) continue;
    const Ticks first = std::uniform_int_distribution<Ticks>(1, budget - 1)(random);
    const Split split{task, first, budget - first};
    std::vector<TimedTask> shorter = set.tasks;
    shorter[task].budget = first;
    const auto begins = policy == CorePolicy::edf ? edf_response_of_first(set.tasks, task, first)
                                                  : fixed_priority_responses(shorter).bounds[task];
    REQUIRE(begins);
    const auto goes_on =
        continuation_response(set.tasks, policy, {task, split.rest, *begins, *whole.responses.bounds[task], 0});
    REQUIRE(goes_on);
    REQUIRE(*begins <= *whole.responses.bounds[task]);
    const Longest seen = play_many(set, dispatch, split, random);
    CAPTURE(describe(set));
    CAPTURE(task);
    CAPTURE(first);
    REQUIRE(seen.first <= *begins);
    REQUIRE(seen.rest <= *goes_on);
    ++compared;
    attained_first += seen.first == *begins;
    attained_rest += seen.rest == *goes_on;
  }
  MESSAGE("of " << compared << " sets the bound is attained by the first piece in " << attained_first
                << ", by the second in " << attained_rest);
  CHECK(attained_first > 0.8 * compared);
  CHECK(attained_rest > 0.6 * compared);
}

}  // namespace

TEST_CASE("fixed priorities: what a job begins with and what it goes on with") {
  compare(21, 3'000, CorePolicy::fixed_priority, Dispatch::fixed_priority);
}

TEST_CASE("EDF: what a job begins with and what it goes on with") {
  compare(22, 3'000, CorePolicy::edf, Dispatch::edf);
}
