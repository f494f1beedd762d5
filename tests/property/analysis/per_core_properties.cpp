// SPDX-License-Identifier: Apache-2.0
// The exact tests of one core against simulation, both ways: what they call schedulable shows no miss, what they do not
// is witnessed by one, and each worst response happens.
#include <doctest/doctest.h>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include "random_sets.hpp"
#include "rt/sched/analysis/edf.hpp"
#include "rt/sched/analysis/fixed_priority.hpp"
#include "tests/property_scale.hpp"

namespace {

using namespace takt::analysis;
constexpr int kSets = 10'000;

struct Seen {
  std::vector<Ticks> longest;  ///< response per task
  bool late = false;

  explicit Seen(const TaskSet& set) : longest(set.tasks.size(), 0) {}
  void add(const std::vector<SimulatedJob>& jobs) {
    for (const SimulatedJob& job : jobs) {
      longest[job.task] = std::max(longest[job.task], job.response());
      late = late || job.late();
    }
  }
};

/// The worst patterns from every instant of a hyperperiod, not only those that the analyses pick.
Seen simulate_all_starts(const TaskSet& set, Dispatch dispatch) {
  Seen seen(set);
  const Ticks steady = steady_from(set), common = *common_period(set.tasks);
  for (Ticks start = steady; start < steady + common_period_of_fixed(set); ++start) {
    seen.add(simulate(set, dispatch, worst_from(set, start, start + 2 * common + 24)));
  }
  return seen;
}

void attack_at_random(const TaskSet& set, Dispatch dispatch, std::mt19937& random, Seen& seen) {
  SimulationHooks hooks;
  hooks.duration = [&](const SimulatedJob& job) {
    return std::uniform_int_distribution<Ticks>(random() % 2 ? set.tasks[job.task].budget : 1,
                                                set.tasks[job.task].budget)(random);
  };
  seen.add(simulate(set, dispatch, random_arrivals(set, 100, random), hooks));
}

/// Both exact tests say what the simulation `seen` says, and no random attack gets beyond the bounds.
void require_agreement(const TaskSet& set, Dispatch dispatch, const DemandAnswer& answer, const ResponseBounds& bounds,
                       std::mt19937& random, Seen& seen) {
  REQUIRE(answer.verdict == (seen.late ? Verdict::not_schedulable : Verdict::schedulable));
  REQUIRE(bounds.exact);
  REQUIRE(verdict_of(set.tasks, bounds) == answer.verdict);
  attack_at_random(set, dispatch, random, seen);
  for (size_t task = 0; task < set.tasks.size(); ++task) REQUIRE(seen.longest[task] <= *bounds.bounds[task]);
}

/// Sporadic tasks under non-preemptive EDF: all arrive at 1, or one of them a tick earlier and holds the core.
Seen simulate_blockers(const TaskSet& set) {
  Seen seen(set);
  const Ticks end = 3 * *common_period(set.tasks);
  for (size_t blocker = 0; blocker <= set.tasks.size(); ++blocker) {
    auto arrivals = worst_from(set, 1, end);
    if (blocker < set.tasks.size()) arrivals[blocker] = periodic_arrivals(set.tasks[blocker], end);
    seen.add(simulate(set, Dispatch::non_preemptive_edf, arrivals));
  }
  return seen;
}

struct Count {
  int schedulable = 0, not_schedulable = 0;
  void add(bool fits) { ++(fits ? schedulable : not_schedulable); }
  void report(const char* what) const {
    MESSAGE(std::string(what) << ": " << schedulable << " schedulable, " << not_schedulable << " not");
    CHECK(schedulable > 0.15 * (schedulable + not_schedulable));
    CHECK(not_schedulable > 0.15 * (schedulable + not_schedulable));
  }
};

}  // namespace

TEST_CASE("fixed priorities: every response bound is the longest simulated response") {
  std::mt19937 random(takt::test::seed(1));
  Count count;
  for (int i = 0; i < takt::test::rounds(kSets); ++i) {
    const TaskSet set = random_set(random);
    const ResponseBounds bounds = fixed_priority_responses(set.tasks);
    const Seen seen = simulate_all_starts(set, Dispatch::fixed_priority);
    CAPTURE(describe(set));
    REQUIRE(bounds.exact);
    for (size_t task = 0; task < set.tasks.size(); ++task) {
      CAPTURE(task);
      REQUIRE(bounds.bounds[task].has_value());
      REQUIRE(*bounds.bounds[task] == seen.longest[task]);
    }
    const bool fits = verdict_of(set.tasks, bounds) == Verdict::schedulable;
    REQUIRE(fits == !seen.late);
    count.add(fits);
    Seen attacked(set);
    attack_at_random(set, Dispatch::fixed_priority, random, attacked);
    for (size_t task = 0; task < set.tasks.size(); ++task) REQUIRE(attacked.longest[task] <= *bounds.bounds[task]);
  }
  count.report("fixed priorities");
}

TEST_CASE("EDF: a set fails the demand test exactly if a simulated job misses") {
  std::mt19937 random(takt::test::seed(2));
  Count count;
  for (int i = 0; i < takt::test::rounds(kSets); ++i) {
    const TaskSet set = random_set(random, {.least_load = 0.75, .tight = 0.9});
    const DemandAnswer answer = edf_demand_test(set.tasks);
    Seen seen = simulate_all_starts(set, Dispatch::edf);
    CAPTURE(describe(set));
    REQUIRE(answer.overload.has_value() == seen.late);
    count.add(!seen.late);
    require_agreement(set, Dispatch::edf, answer, edf_responses(set.tasks), random, seen);
  }
  count.report("EDF");
}

TEST_CASE("non-preemptive EDF, sporadic: a set fails exactly if a simulated job misses") {
  std::mt19937 random(takt::test::seed(3));
  Count count;
  for (int i = 0; i < takt::test::rounds(kSets); ++i) {
    const TaskSet set = random_set(random, {.offsets = false});
    Seen seen = simulate_blockers(set);
    CAPTURE(describe(set));
    count.add(!seen.late);
    require_agreement(set, Dispatch::non_preemptive_edf, non_preemptive_edf_demand_test(set.tasks),
                      non_preemptive_edf_responses(set.tasks), random, seen);
  }
  count.report("non-preemptive EDF, sporadic");
}

TEST_CASE("non-preemptive EDF with offsets: nothing that it calls schedulable misses") {
  std::mt19937 random(takt::test::seed(4));
  int proven = 0, refused = 0, refused_without_miss = 0;
  for (int i = 0; i < takt::test::rounds(kSets / 2); ++i) {
    const TaskSet set = random_set(random, {.sporadic = 0.2});
    const bool fits = non_preemptive_edf_demand_test(set.tasks).verdict == Verdict::schedulable;
    const ResponseBounds bounds = non_preemptive_edf_responses(set.tasks);
    Seen seen = simulate_all_starts(set, Dispatch::non_preemptive_edf);
    for (int k = 0; k < 3; ++k) attack_at_random(set, Dispatch::non_preemptive_edf, random, seen);
    CAPTURE(describe(set));
    if (fits) REQUIRE(!seen.late);
    for (size_t task = 0; task < set.tasks.size(); ++task) REQUIRE(seen.longest[task] <= *bounds.bounds[task]);
    ++(fits ? proven : refused);
    refused_without_miss += !fits && !seen.late;
  }
  MESSAGE("non-preemptive EDF with offsets: " << proven << " proven, " << refused << " refused, "
                                              << refused_without_miss << " of them without a miss in simulation");
  CHECK(proven > 0.15 * takt::test::rounds(kSets / 2));
  CHECK(refused > 0.15 * takt::test::rounds(kSets / 2));
}
