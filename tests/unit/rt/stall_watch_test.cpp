// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/stall_watch.hpp"

#include <doctest/doctest.h>

#include "rt/sched/run_board.hpp"
#include "tests/nanoseconds.hpp"
#include "tests/unit/rt/plans.hpp"

using namespace takt;
using test::kMs;

TEST_CASE("stalls: stolen time lies between two readings, and in the tick before them") {
  int64_t total_ns = 700 * kMs;  // of what was before the run
  StallLog log;
  StealReader reader([&] { return total_ns; }, 10 * kMs);
  reader.look(1'000 * kMs, log);
  reader.look(1'050 * kMs, log);
  CHECK(log.stalls().empty());
  total_ns += 30 * kMs;
  reader.look(1'100 * kMs, log);
  REQUIRE(log.stalls().size() == 1);
  CHECK(log.stalls()[0].from_ns == 1'040 * kMs);
  CHECK(log.stalls()[0].to_ns == 1'100 * kMs);
  CHECK(log.stalls()[0].away_ns == 30 * kMs);
}

TEST_CASE("stalls: of two witnesses the one that saw more of it counts, and nothing of another time") {
  const std::vector<Stall> stalls = {{0, 50, 10, Stall::kAllCpus}, {10, 30, 20, 0}, {60, 70, 5, 0}, {60, 70, 8, 1}};
  CHECK(away_ns(stalls, 0, 100) == 25);
  CHECK(away_ns(stalls, 0, 40) == 20);
  CHECK(away_ns(stalls, 40, 55) == 10);
  CHECK(away_ns(stalls, 55, 100) == 8);
  CHECK(away_ns(stalls, 80, 100) == 0);
}

TEST_CASE("stalls: time in which jobs were under way is no stall") {
  test::Idle node;
  Plan plan;
  test::add_task(plan, node, "node", 0);
  RunBoard board(plan);
  TaskStatistics& s = board.task(0);
  const auto ran = [&](int64_t from_ns, int64_t to_ns) {
    s.jobs[s.job_count.load() % s.jobs.size()] = {from_ns, from_ns, to_ns, 0};
    s.job_count.fetch_add(1);
  };
  CHECK(idle_ns(board, 1, 100, 200) == 100);
  ran(90, 110);
  ran(120, 150);
  ran(160, 190);
  CHECK(idle_ns(board, 1, 100, 200) == 30);
  CHECK(idle_ns(board, 1, 200, 300) == 100);
}

TEST_CASE("stalls: what finds no place is counted") {
  StallLog log;
  for (size_t i = 0; i < StallLog::kMost + 3; ++i) log.add({});
  CHECK(log.stalls().size() == StallLog::kMost);
  CHECK(log.lost() == 3);
}

TEST_CASE("bounds: all samples above are counted, the first and the largest are logged") {
  ExcessLog log;
  ProofBound bound;
  bound.compare({Excess::response, 0, 0, 0, 1'000'000}, log);
  CHECK(bound.above() == 0);  // no bound
  bound.set(100);
  bound.compare({Excess::response, 0, 0, 0, 100}, log);
  CHECK(bound.above() == 0);
  for (int64_t i = 0; i < 100; ++i) bound.compare({Excess::response, 0, 0, i, 101}, log);
  bound.compare({Excess::response, 0, 0, 100, 102}, log);
  CHECK(bound.above() == 101);
  CHECK(log.size() == ProofBound::kLogged + 1);
  CHECK(log.at(ProofBound::kLogged)->observed_ns == 102);
}
