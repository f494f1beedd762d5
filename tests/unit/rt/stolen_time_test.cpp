// SPDX-License-Identifier: Apache-2.0
// What the host took lately, and what follows for a late job.
#include "rt/sched/stolen_time.hpp"

#include <doctest/doctest.h>

#include "rt/sched/watch_rules.hpp"
#include "tests/nanoseconds.hpp"

using namespace takt;
using test::kMs;

TEST_CASE("stolen time: the window moves on, readings are as rare as they may be") {
  int64_t total = 500 * kMs;
  int reads = 0;
  StolenTime stolen([&] { return ++reads, total; });
  CHECK(stolen.recent_ns() == 0);
  stolen.look(1000 * kMs);
  CHECK(stolen.recent_ns() == 0);  // how much of the total is recent is not known
  total += 30 * kMs;
  stolen.look(1010 * kMs);
  CHECK(reads == 1);
  CHECK(stolen.recent_ns() == 0);
  stolen.look(1050 * kMs);
  CHECK(stolen.recent_ns() == 30 * kMs);
  for (int64_t at = 1100; at <= 2950; at += 50) stolen.look(at * kMs);
  CHECK(stolen.recent_ns() == 30 * kMs);
  for (int64_t at = 3000; at <= 3100; at += 50) stolen.look(at * kMs);
  CHECK(stolen.recent_ns() == 0);
}

TEST_CASE("stolen time: without a counter nothing is taken") {
  StolenTime stolen({});
  for (int64_t at = 0; at <= 200; at += 50) stolen.look(at * kMs);
  CHECK(stolen.recent_ns() == 0);
}

TEST_CASE("a late job is lifted only for what the host took, and dropped if it uses more") {
  TaskPlan task;
  task.budget_ns = 5 * kMs;
  task.deadline_ns = 50 * kMs;
  WatchSight sight;
  sight.now_ns = 60 * kMs;
  sight.running = true;
  sight.stolen_ns = 20 * kMs;
  sight.cpu_left_ns = -20 * kMs;
  const auto judged = [&](Policy granted) { return judge(watch_rules(task, granted, 1000 * kMs), sight); };
  CHECK(judged(Policy::deadline).lift);
  CHECK_FALSE(judged(Policy::fixed).lift);
  CHECK_FALSE(judged(Policy::cooperative).lift);
  SUBCASE("its own overrun") {
    sight.cpu_left_ns = -21 * kMs;
    CHECK_FALSE(judged(Policy::deadline).lift);
    sight.lifted = true;
    CHECK(judged(Policy::deadline).drop);
  }
  SUBCASE("in time still") {
    sight.now_ns = 50 * kMs;
    CHECK_FALSE(judged(Policy::deadline).lift);
  }
  SUBCASE("nothing stolen") {
    sight.stolen_ns = 0;
    sight.cpu_left_ns = 1 * kMs;
    CHECK_FALSE(judged(Policy::deadline).lift);
  }
  SUBCASE("late without owing anything") {
    sight.cpu_left_ns = 1 * kMs;
    CHECK_FALSE(judged(Policy::deadline).lift);
    sight.owed_ns = 3 * kMs;  // from the job before
    CHECK(judged(Policy::deadline).lift);
  }
  SUBCASE("one that used up its reservation may use half a budget more before it is dropped") {
    sight.stolen_ns = 0;
    sight.lifted = true;
    sight.cpu_left_ns = -2'500'000;
    CHECK_FALSE(judged(Policy::deadline).drop);
    sight.cpu_left_ns = -2'500'001;
    CHECK(judged(Policy::deadline).drop);
  }
  SUBCASE("one of high criticality may use more before it is dropped") {
    task.criticality = Criticality::high;
    sight.lifted = true;
    sight.cpu_left_ns = -50 * kMs;
    CHECK_FALSE(judged(Policy::deadline).drop);
    sight.cpu_left_ns = -51 * kMs;
    CHECK(judged(Policy::deadline).drop);
  }
  SUBCASE("an ordinary thread cannot be dropped further") {
    sight.lifted = sight.ordinary = true;
    sight.cpu_left_ns = -1000 * kMs;
    CHECK_FALSE(judged(Policy::deadline).drop);
    CHECK_FALSE(judged(Policy::deadline).lift);
    sight.cpu_left_ns = -20 * kMs;  // of which the host took all
    CHECK(judged(Policy::deadline).lift);
  }
  SUBCASE("once, but for one that was lifted behind all workers before it was late") {
    sight.lifted = true;
    CHECK(judged(Policy::deadline).lift);
    sight.first = true;
    CHECK_FALSE(judged(Policy::deadline).lift);
    CHECK_FALSE(judged(Policy::deadline).drop);
  }
}

TEST_CASE("a reservation that is used up: the worker is lifted once it stands, and looked at no more than needed") {
  TaskPlan task;
  CHECK(watch_rules(task, Policy::deadline, 1000 * kMs).low);
  task.criticality = Criticality::high;
  CHECK_FALSE(watch_rules(task, Policy::deadline, 1000 * kMs).low);
  ReserveSight sight;
  sight.release_ns = 100 * kMs;
  sight.runtime_ns = 4 * kMs;
  sight.now_ns = 90 * kMs;
  CHECK(judge_reserve(sight).look_again_ns == 104 * kMs);
  sight.now_ns = 104 * kMs;
  sight.left_ns = 3 * kMs;
  CHECK(judge_reserve(sight).look_again_ns == 107 * kMs);
  CHECK_FALSE(judge_reserve(sight).lift);
  sight.now_ns = 110 * kMs;
  sight.left_ns = -2 * kMs;
  CHECK(judge_reserve(sight).look_again_ns == 110 * kMs + kReserveGrain_ns);
  CHECK_FALSE(judge_reserve(sight).lift);  // it may still be served
  sight.stands = true;
  sight.deadline_ns = 50 * kMs;
  sight.left_ns = kReserveSlack_ns + 1;
  CHECK_FALSE(judge_reserve(sight).lift);
  sight.left_ns = kReserveSlack_ns;
  CHECK(judge_reserve(sight).lift);
  sight.left_ns = -2 * kMs;
  CHECK(judge_reserve(sight).lift);
  sight.owed_ns = 49 * kMs;
  CHECK_FALSE(judge_reserve(sight).lift);  // it would be dropped again
  sight.owed_ns = 0;
  SUBCASE("once") {
    sight.lifted = true;
    CHECK_FALSE(judge_reserve(sight).lift);
  }
  SUBCASE("forgotten by the kernel, whatever it owes and however late") {
    sight.low = true;
    sight.period_ns = 50 * kMs;
    sight.now_ns = 600 * kMs;
    sight.owed_ns = 1000 * kMs;
    sight.stood_ns = 4 * sight.period_ns + kForgotten_ns;
    CHECK_FALSE(judge_reserve(sight).rescue);
    sight.stood_ns += 1;
    CHECK(judge_reserve(sight).rescue);
    CHECK_FALSE(judge_reserve(sight).lift);
    sight.lifted = true;
    CHECK_FALSE(judge_reserve(sight).rescue);
  }
  SUBCASE("late, as one of high criticality") {
    sight.now_ns = 151 * kMs;
    CHECK(judge_reserve(sight).lift);
  }
  SUBCASE("late, as one of low criticality: its reservation is due again") {
    sight.low = true;
    CHECK(judge_reserve(sight).lift);
    sight.now_ns = 150 * kMs;
    CHECK(judge_reserve(sight).lift);
    sight.now_ns = 151 * kMs;
    CHECK_FALSE(judge_reserve(sight).lift);
    CHECK(judge_reserve(sight).look_again_ns > sight.now_ns + kReserveGrain_ns);
  }
}
