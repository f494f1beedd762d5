// SPDX-License-Identifier: Apache-2.0
// Examples of the literature with the results printed there.
#include "rt/sched/analysis/edf.hpp"
#include "rt/sched/analysis/fixed_priority.hpp"
#include "sets.hpp"

using namespace takt::analysis;

TEST_CASE("Burns & Wellings, Real-Time Systems and Programming Languages: response time analysis") {
  CHECK(fixed_priority_responses(tasks_of({{3, 7, 7}, {3, 12, 12}, {5, 20, 20}})).bounds == Bounds{3, 6, 20});
  CHECK(fixed_priority_responses(tasks_of({{5, 20, 20}, {10, 40, 40}, {40, 80, 80}})).bounds == Bounds{5, 15, 80});
  // deadline monotonic
  CHECK(fixed_priority_responses(tasks_of({{3, 5, 20}, {3, 7, 15}, {4, 10, 10}, {3, 20, 20}})).bounds ==
        Bounds{3, 6, 10, 20});
}

TEST_CASE("Burns & Wellings: offsets make schedulable what is not released together") {
  const auto together = tasks_of({{4, 5, 8}, {4, 10, 20}, {4, 12, 20}}, false);
  CHECK(fixed_priority_responses(together).bounds == Bounds{4, 8, 16});
  const auto apart = tasks_of({{4, 5, 8}, {4, 10, 20}, {4, 12, 20, 10}}, false);
  CHECK(fixed_priority_responses(apart).bounds == Bounds{4, 8, 8});
  CHECK(verdict_of(together, fixed_priority_responses(together)) == Verdict::not_schedulable);
  CHECK(verdict_of(apart, fixed_priority_responses(apart)) == Verdict::schedulable);
}

TEST_CASE("Buttazzo, Hard Real-Time Computing Systems: response time analysis") {
  CHECK(fixed_priority_responses(tasks_of({{1, 3, 4}, {1, 4, 5}, {2, 5, 6}, {1, 10, 11}})).bounds.back() == 10);
}

TEST_CASE("Lehoczky 1990: the longest response is not the first one in the busy period") {
  const ResponseBounds found = fixed_priority_responses(tasks_of({{26, 70, 70}, {62, 100, 100}}));
  CHECK(found.bounds == Bounds{26, 118});  // jobs of the second take 114, 102, 116, 104, 118, 106, 94
}

TEST_CASE("Liu & Layland 1973: rate monotonic fails below a utilisation of 1, EDF does not") {
  const auto tasks = tasks_of({{2, 5, 5}, {4, 7, 7}});  // as in Buttazzo's comparison, 34/35
  CHECK(verdict_of(tasks, fixed_priority_responses(tasks)) == Verdict::not_schedulable);
  CHECK(edf_demand_test(tasks).verdict == Verdict::schedulable);
}

TEST_CASE("Buttazzo: processor demand criterion, table 4.4") {
  auto tasks = tasks_of({{2, 4, 6}, {2, 5, 8}, {3, 7, 9}});  // utilisation 11/12, bound L* = 25
  CHECK(edf_demand_test(tasks).verdict == Verdict::schedulable);
  tasks[2].deadline = 6;  // 2 + 2 + 3 within 6
  const DemandAnswer answer = edf_demand_test(tasks);
  CHECK(answer.verdict == Verdict::not_schedulable);
  REQUIRE(answer.overload.has_value());
  CHECK(answer.overload->length == 6);
  CHECK(answer.overload->demand == 7);
}

TEST_CASE("Zhang & Burns 2009: the eight tasks on which QPA is shown, utilisation 0.803") {
  CHECK(edf_demand_test(tasks_of({{6000, 18000, 31000},
                                  {2000, 9000, 9800},
                                  {1000, 12000, 17000},
                                  {90, 3000, 4200},
                                  {8, 78, 96},
                                  {2, 16, 12},
                                  {10, 120, 280},
                                  {26, 160, 660}}))
            .verdict == Verdict::schedulable);
}

// The figures that come with the implementation of Bozhko & Brandenburg, "Abstract Response-Time Analysis" (ECRTS
// 2020), crate response-time-analysis 0.3.2. Some deadlines there exceed the period.
TEST_CASE("Bozhko & Brandenburg: EDF responses") {
  CHECK(edf_responses(tasks_of({{79, 50, 120}, {11, 100, 34}, {1, 120, 190}})).bounds == Bounds{79, 101, 121});
  CHECK(edf_responses(tasks_of({{1, 5, 5}, {100, 1000, 1000}, {2, 10, 10}, {5, 45, 20}, {10, 50, 50}})).bounds ==
        Bounds{1, 694, 3, 22, 27});
}

TEST_CASE("Bozhko & Brandenburg: non-preemptive EDF responses") {
  CHECK(non_preemptive_edf_responses(tasks_of({{79, 100, 120}, {11, 100, 34}, {1, 100, 190}})).bounds ==
        Bounds{91, 91, 91});
  CHECK(non_preemptive_edf_responses(tasks_of({{79, 50, 120}, {11, 100, 34}, {1, 120, 190}})).bounds ==
        Bounds{89, 90, 121});
  CHECK(non_preemptive_edf_responses(tasks_of({{5, 29, 20}, {10, 30, 20}})).bounds == Bounds{14, 15});
}

// Condition 2 of Jeffay, Stanat & Martel 1991, in figures of our own.
TEST_CASE("non-preemptive EDF: a long job at a low rate ruins a high rate") {
  CHECK(non_preemptive_edf_demand_test(tasks_of({{2, 12, 12}, {2, 8, 8}, {9, 20, 20}})).verdict ==
        Verdict::not_schedulable);  // all at once fit; 9 - 1 + 2 > 8 if the third is a tick earlier
  CHECK(non_preemptive_edf_demand_test(tasks_of({{2, 12, 12}, {2, 8, 8}, {7, 20, 20}})).verdict ==
        Verdict::schedulable);
}
