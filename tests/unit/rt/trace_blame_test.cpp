// SPDX-License-Identifier: Apache-2.0
// One cause at a time, on traces written by hand.
#include <doctest/doctest.h>

#include "tests/unit/rt/trace_fixture.hpp"

namespace {

using namespace takt::trace;
using namespace takt::trace::by_hand;
constexpr auto kPreempted = Slice::End::preempted, kAsleep = Slice::End::asleep;

/// Blame of the last job; the parts must always make up the miss.
Blame blame_last(const Trace& trace) {
  const Evidence evidence(trace);
  const Blame result = blame(evidence, trace.jobs.back());
  CHECK(sum_ns(result) == result.miss_ns);
  CHECK(result.miss_ns == trace.jobs.back().published_ns - trace.jobs.back().deadline_ns);
  return result;
}

}  // namespace

TEST_CASE("the sentence of the house plan: released late, preempted by name, over budget") {
  Trace trace = two_lanes();
  // Released at 0, on its CPU at 300; stereo takes that CPU for 9.1 ms; 9.8 ms of execution on a budget of 5.
  trace.jobs = {job(0, 7, 4'000, 4'000, 13'100, 9'100), job(1, 81, 0, 300, 19'200, 9'800)};
  trace.slices = {slice(12, 1, 300, 4'000, kPreempted, 300), slice(11, 1, 4'000, 13'100, kAsleep, 4'000),
                  slice(12, 1, 13'100, 19'200, kAsleep)};
  const Blame result = blame_last(trace);
  CHECK(result.miss_ns == 9'200 * kUs);
  CHECK(part_us(result, Cause::late) == 300);
  CHECK(part_us(result, Cause::preempted, "stereo") == 9'100);
  CHECK(part_us(result, Cause::budget) == 4'800);
  CHECK(part_us(result, Cause::slack) == -5'000);
}

TEST_CASE("released late behind somebody who is no node") {
  Trace trace = two_lanes();
  trace.jobs = {job(1, 3, 0, 3'000, 12'000, 9'000)};
  trace.slices = {slice(99, 0, 0, 5'000, kAsleep), slice(99, 1, -500, 2'990, kPreempted),
                  slice(12, 1, 2'990, 12'000, kAsleep, 10)};
  const Blame result = blame_last(trace);
  CHECK(part_us(result, Cause::behind, "cc1plus") == 2'980);
  CHECK(part_us(result, Cause::late) == 20);  // the timer, and the way into the job
  CHECK(part_us(result, Cause::budget) == 4'000);
}

TEST_CASE("a follower that waits for its lane, and a head that waits for its own previous job") {
  Trace trace = two_lanes();
  trace.jobs = {job(1, 0, 0, 0, 6'000, 6'000), job(2, 0, 1'000, 6'000, 14'000, 8'000)};
  trace.slices = {slice(12, 1, 0, 14'000, kAsleep)};
  CHECK(part_us(blame_last(trace), Cause::lane, "camera") == 5'000);
  trace.jobs[1] = job(1, 1, 1'000, 6'000, 14'000, 8'000);
  const Blame own = blame_last(trace);
  CHECK(part_us(own, Cause::lane, "camera") == 5'000);
  CHECK(part_us(own, Cause::budget) == 3'000);
}

TEST_CASE("cooperative: what ran on the same worker is not of the lane") {
  Trace trace = two_lanes();
  trace.jobs = {job(0, 0, 0, 0, 9'000, 9'000), job(1, 1, 1'000, 9'000, 14'000, 5'000)};
  trace.jobs[0].thread = 12;
  trace.slices = {slice(12, 1, 0, 14'000, kAsleep)};
  CHECK(part_us(blame_last(trace), Cause::queue, "stereo") == 8'000);
}

TEST_CASE("sleep in the job ends with the wake-up; the wait for a CPU after it is somebody's") {
  Trace trace = two_lanes();
  trace.jobs = {job(1, 1, 0, 0, 12'000, 3'000)};
  trace.slices = {slice(12, 1, 0, 1'000, kAsleep), slice(99, 1, 5'000, 10'000, kPreempted),
                  slice(12, 1, 10'000, 12'000, kAsleep, 8'000)};
  const Blame result = blame_last(trace);
  CHECK(part_us(result, Cause::asleep) == 7'000);
  CHECK(part_us(result, Cause::preempted, "cc1plus") == 2'000);
}

TEST_CASE("SCHED_DEADLINE: an idle CPU, or an ordinary thread on it, means throttled") {
  Trace trace = two_lanes();
  trace.jobs = {job(1, 1, 0, 0, 20'000, 8'000)};
  trace.slices = {slice(12, 1, 0, 5'000, kPreempted, 0, -1), slice(99, 1, 6'000, 9'000, kPreempted, 0, 120),
                  slice(12, 1, 17'000, 20'000, kAsleep, 0, -1)};
  CHECK(part_us(blame_last(trace), Cause::throttled) == 12'000);
  trace.steals = {{0, 20'000 * kUs, 10'000 * kUs, 1}};  // but of the 8 ms of idle CPU the host had most
  CHECK(part_us(blame_last(trace), Cause::stall) == 8'000 + 3'000 + 1'000);
  trace.steals.clear();
  trace.slices[1].priority = -1;  // but another deadline thread preempts
  CHECK(part_us(blame_last(trace), Cause::preempted, "cc1plus") == 3'000);
}

TEST_CASE("the CPU clock stood still while the thread had the CPU: the host, where it took time from that CPU then") {
  Trace trace = two_lanes();
  trace.jobs = {job(1, 1, 200'000, 200'000, 240'000, 5'000)};
  trace.slices = {slice(12, 1, 200'000, 240'000, kAsleep)};
  CHECK(part_us(blame_last(trace), Cause::unattributed) == 35'000);
  const auto stall_us = [&](int64_t from_us, int64_t to_us, int64_t stolen_us, int cpu) {
    trace.steals = {{from_us * kUs, to_us * kUs, stolen_us * kUs, cpu}};
    const Blame result = blame_last(trace);
    const int64_t stall = part_us(result, Cause::stall);
    CHECK(stall + part_us(result, Cause::unattributed) == 35'000);
    return stall;
  };
  CHECK(stall_us(180'000, 280'000, 30'000, 1) == 35'000);
  CHECK(stall_us(180'000, 280'000, 10'000, 1) == 20'000);  // what shows, and a tick that may not show yet
  CHECK(stall_us(180'000, 280'000, 30'000, 0) == 0);       // from another CPU
  CHECK(stall_us(100'000, 200'000, 30'000, 1) == 0);       // before the job
  CHECK(stall_us(249'000, 349'000, 30'000, 1) == 35'000);  // counted at the next tick
  CHECK(stall_us(250'000, 350'000, 30'000, 1) == 0);       // later
  trace.source = Source::none;                             // what did not run may as well have been preempted
  CHECK(stall_us(180'000, 280'000, 30'000, 1) == 0);
}

TEST_CASE("a job that moved to another CPU: each CPU's stolen time counts for the time it was there") {
  Trace trace = two_lanes();
  trace.jobs = {job(1, 1, 0, 0, 60'000, 5'000)};
  trace.slices = {slice(12, 0, 0, 10'000, kPreempted), slice(12, 1, 10'000, 60'000, kAsleep)};
  trace.steals = {{30'000 * kUs, 50'000 * kUs, 10'000 * kUs, 0}};
  CHECK(part_us(blame_last(trace), Cause::stall) == 0);
  trace.steals.push_back({30'000 * kUs, 50'000 * kUs, 10'000 * kUs, 1});
  CHECK(part_us(blame_last(trace), Cause::stall) == 20'000);
}

TEST_CASE("a late timer on a CPU from which the host took time is a host stall, whoever ran there") {
  Trace trace = two_lanes();
  trace.jobs = {job(1, 1, 0, 4'000, 11'000, 7'000)};
  // The timer was set on CPU 0, where the thread ran last; it runs on CPU 1 now.
  trace.slices = {slice(12, 0, -900, -500, kAsleep), slice(99, 0, -400, 3'000, kPreempted),
                  slice(12, 1, 3'990, 11'000, kAsleep, 3'980)};
  trace.steals = {{0, 100'000 * kUs, 10'000 * kUs, 1}};
  CHECK(part_us(blame_last(trace), Cause::late) == 4'000);
  trace.steals[0].cpu = 0;
  const Blame result = blame_last(trace);
  CHECK(part_us(result, Cause::stall) == 3'980);
  CHECK(part_us(result, Cause::late) == 20);
}

TEST_CASE("perf names our own threads only; without a source what did not run is unattributed") {
  Trace trace = two_lanes(Source::perf);
  trace.jobs = {job(1, 1, 0, 300, 15'000, 6'000)};
  trace.slices = {slice(12, 1, 300, 4'000, kPreempted), slice(12, 1, 12'700, 15'000, kAsleep)};
  Blame result = blame_last(trace);
  REQUIRE(part_us(result, Cause::preempted) == 8'700);
  for (const Part& part : result.parts) CHECK(part.who.empty());
  trace.jobs.insert(trace.jobs.begin(), job(0, 7, 4'500, 4'500, 12'000, 7'500));
  trace.slices.insert(trace.slices.begin() + 1, slice(11, 1, 4'500, 12'000, kAsleep));
  result = blame_last(trace);
  CHECK(part_us(result, Cause::preempted, "stereo") == 7'500);
  CHECK(part_us(result, Cause::preempted) == 8'700);  // 0.5 before it and 0.7 after it somebody else's
  trace.jobs.erase(trace.jobs.begin());
  trace.source = Source::none;
  trace.slices.clear();
  result = blame_last(trace);
  CHECK(part_us(result, Cause::unattributed) == 8'700);
  CHECK(part_us(result, Cause::late) == 300);
  CHECK(part_us(result, Cause::budget) == 1'000);
}

TEST_CASE("without a stated budget all of the execution is told") {
  Trace trace = two_lanes();
  trace.tasks[1].budget_ns = 0;
  trace.jobs = {job(1, 1, 0, 0, 12'000, 12'000)};
  trace.slices = {slice(12, 1, 0, 12'000, kAsleep)};
  const Blame result = blame_last(trace);
  CHECK(part_us(result, Cause::execution) == 12'000);
  CHECK(part_us(result, Cause::slack) == -10'000);
}
