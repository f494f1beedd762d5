// SPDX-License-Identifier: Apache-2.0
// Blame on random traces: the parts make up the miss to the nanosecond, the course has no gap, and both agree with a
// reference that asks at every instant anew what was going on.
#include <doctest/doctest.h>

#include <algorithm>
#include <map>
#include <random>

#include "rt/trace/blame.hpp"
#include "tests/property_scale.hpp"

namespace {

using namespace takt::trace;

struct RandomNumber {
  std::mt19937 engine;
  int64_t operator()(int64_t low, int64_t high) { return std::uniform_int_distribution<int64_t>(low, high)(engine); }
};

constexpr int64_t kUnit = 1'000'000;  // ns

void in_units(Trace& trace) {
  const auto scale = [](auto&... instants) { ((instants *= kUnit), ...); };
  for (TaskFacts& task : trace.tasks) scale(task.budget_ns);
  for (Slice& slice : trace.slices) scale(slice.from_ns, slice.to_ns, slice.woken_ns);
  for (JobSpan& job : trace.jobs)
    scale(job.start_ns, job.release_ns, job.published_ns, job.finish_ns, job.deadline_ns, job.cpu_ns);
  for (Steal& steal : trace.steals) scale(steal.from_ns, steal.to_ns, steal.stolen_ns);
}

/// Some threads that take turns on two CPUs, instant by instant, and jobs anywhere on them, in whole units.
Trace random_trace(RandomNumber& random) {
  Trace trace;
  trace.source = static_cast<Source>(random(0, 3));
  for (size_t t = 0; t < 4; ++t)
    trace.tasks.push_back({"n" + std::to_string(t), t / 2, 1, random(0, 3) == 0 ? 0 : random(1, 60), false, {}, {}});
  trace.threads = {{10, "t10"}, {11, "t11"}};
  trace.names = {"a", "b", "c", "d"};
  for (int cpu = 0; cpu < 2; ++cpu) {
    for (int64_t at = random(-50, 20); at < 300;) {
      const int64_t end = at + random(1, 40);
      const auto who = static_cast<uint32_t>(random(0, 3));
      // Threads 10, 11 live on the CPU of their number, so that no thread runs twice at one time.
      const int32_t thread = who < 2 ? 10 + cpu : 20 + static_cast<int32_t>(who) + 10 * cpu;
      trace.slices.push_back({at, end, random(0, 1) == 0 ? std::max<int64_t>(1, at - random(0, 30)) : 0, thread,
                              static_cast<int32_t>(random(-1, 1)), cpu, who,
                              random(0, 1) == 0 ? Slice::End::preempted : Slice::End::asleep});
      at = end + (random(0, 2) == 0 ? random(0, 20) : 0);
    }
  }
  for (int32_t thread = 10; thread < 12; ++thread) {
    uint32_t number = 0;
    for (int64_t at = random(0, 30); at < 250;) {
      JobSpan job;
      job.thread = thread;
      job.task = static_cast<uint16_t>(2 * (thread - 10) + random(0, 1));
      job.job = number++;
      job.start_ns = at;
      job.release_ns = at - random(-5, 60);
      job.published_ns = job.finish_ns = at + random(0, 60);
      job.deadline_ns = job.release_ns + random(1, 80);
      job.cpu_ns = random(0, 70);
      trace.jobs.push_back(job);
      at = job.published_ns + random(0, 20);
    }
  }
  for (int64_t at = random(-50, 300); at < 300; at += random(20, 300))
    trace.steals.push_back({at, at + random(1, 50), random(1, 30), static_cast<int>(random(0, 1))});
  in_units(trace);
  return trace;
}

/// The steals of that CPU that may tell of [from, to).
int64_t stolen(const Trace& trace, int cpu, int64_t from, int64_t to) {
  int64_t sum = 0;
  for (const Steal& steal : trace.steals) {
    const bool before = steal.to_ns <= from, after = steal.from_ns - kStealTickNs >= to;
    if (steal.cpu == cpu && !before && !after) sum += steal.stolen_ns;
  }
  return sum;
}

/// What its parts must say of a job whose CPU clock says less than its slices: [stall, unattributed], by looking at
/// every instant. A job that is known by its CPU clock alone may have been preempted.
std::pair<int64_t, int64_t> stood_still(const Trace& trace, const JobSpan& job) {
  const bool known = trace.source != Source::none;
  std::map<int, std::pair<int64_t, int64_t>> on;  // per CPU: first and last instant
  int64_t had = 0;
  bool seen = false;
  for (const Slice& slice : trace.slices) seen = seen || slice.thread == job.thread;
  for (int64_t at = std::max(job.start_ns, job.release_ns); at < job.published_ns; at += kUnit) {
    int cpu = known && seen ? -1 : job.cpu;
    for (const Slice& slice : trace.slices)
      if (known && slice.thread == job.thread && slice.from_ns <= at && at < slice.to_ns) cpu = slice.cpu;
    if (known && seen && cpu < 0) continue;
    had += kUnit;
    on.try_emplace(cpu, at, 0).first->second.second = at + kUnit;
  }
  const int64_t missing = had - std::min(had, job.cpu_ns);
  int64_t host = 0;
  for (const auto& [cpu, span] : on)
    if (const int64_t shown = stolen(trace, cpu, span.first, span.second); known && seen && shown > 0)
      host += shown + kStealTickNs;
  return {std::min(missing, host), missing - std::min(missing, host)};
}

/// True if the job's thread had a CPU at that instant, by looking at every slice.
bool had_cpu(const Trace& trace, const JobSpan& job, int64_t at) {
  for (const Slice& slice : trace.slices)
    if (slice.thread == job.thread && slice.from_ns <= at && at < slice.to_ns) return true;
  return false;
}

/// Another job of its thread or lane that ran at that instant.
bool other_ran(const Trace& trace, const JobSpan& job, int64_t at) {
  for (const JobSpan& other : trace.jobs)
    if (&other != &job && other.start_ns <= at && at < other.published_ns &&
        (other.thread == job.thread || trace.tasks[other.task].lane == trace.tasks[job.task].lane))
      return true;
  return false;
}

bool may_hold(const Trace& trace, const JobSpan& job, const Piece& piece, int64_t at) {
  const bool known =
      trace.source != Source::none && std::any_of(trace.slices.begin(), trace.slices.end(),
                                                  [&](const Slice& slice) { return slice.thread == job.thread; });
  const bool before = at < job.start_ns, ahead = before && other_ran(trace, job, at);
  const bool on_cpu = known && had_cpu(trace, job, at);
  switch (piece.cause) {
    case Cause::lane:
    case Cause::queue: return ahead;
    case Cause::running: return !before && (on_cpu || !known);
    case Cause::late: return before && !ahead;
    case Cause::behind: return before && !ahead && !on_cpu && known;
    case Cause::stall:
      return !ahead && !on_cpu &&
             stolen(trace, 0, piece.from_ns, piece.to_ns) + stolen(trace, 1, piece.from_ns, piece.to_ns) > 0;
    case Cause::preempted:
    case Cause::asleep: return !before && !on_cpu && known;
    case Cause::unattributed: return !before && !on_cpu;
    case Cause::throttled: return !ahead && !on_cpu && knows_every_cpu(trace.source);
    default: return false;
  }
}

/// Who had that CPU at that instant.
bool occupied_by(const Trace& trace, const Piece& piece, int64_t at) {
  for (const Slice& slice : trace.slices) {
    if (slice.cpu != piece.cpu || at < slice.from_ns || at >= slice.to_ns) continue;
    std::string who = slice.thread < 20 ? "t" + std::to_string(slice.thread) : trace.names[slice.name];
    for (const JobSpan& job : trace.jobs)
      if (job.thread == slice.thread && job.start_ns <= at && at < job.published_ns) who = trace.tasks[job.task].name;
    return who == piece.who;
  }
  return false;
}

}  // namespace

TEST_CASE("parts make up the miss, and every instant holds what was going on then") {
  RandomNumber random{std::mt19937(takt::test::seed(7))};
  size_t misses = 0, stalls = 0, unexplained = 0;
  std::map<Cause, size_t> met;
  for (int round = 0; round < takt::test::rounds(400); ++round) {
    const Trace trace = random_trace(random);
    const Evidence evidence(trace);
    for (const JobSpan& job : trace.jobs) {
      const Blame result = blame(evidence, job);
      int64_t sum = 0, stall = 0, unattributed = 0;
      for (const Part& part : result.parts) {
        sum += part.ns;
        if (part.cause == Cause::stall) stall += part.ns;
        if (part.cause == Cause::unattributed) unattributed += part.ns;
        CHECK((part.ns > 0 || part.cause == Cause::slack));
        CHECK(part.ns != 0);
      }
      REQUIRE(sum == job.published_ns - job.deadline_ns);
      misses += result.miss_ns > 0;
      int64_t at = job.release_ns;
      for (const Piece& piece : course(evidence, job)) {
        REQUIRE(piece.from_ns == at);
        REQUIRE(piece.to_ns > at);
        ++met[piece.cause];
        if (piece.cause == Cause::stall) stall -= piece.to_ns - piece.from_ns;
        if (piece.cause == Cause::unattributed) unattributed -= piece.to_ns - piece.from_ns;
        for (; at < piece.to_ns; at += kUnit) {
          INFO("round ", round, " instant ", at, " cause ", static_cast<int>(piece.cause));
          REQUIRE(may_hold(trace, job, piece, at));
          if (piece.cause == Cause::behind || (piece.cause == Cause::preempted && !piece.who.empty()))
            REQUIRE(occupied_by(trace, piece, at));
        }
      }
      REQUIRE(at == std::max(job.release_ns, job.published_ns));
      INFO("round ", round);
      REQUIRE(std::pair(stall, unattributed) == stood_still(trace, job));
      stalls += stall > 0;
      unexplained += stall > 0 && unattributed > 0;
    }
  }
  CHECK(misses >= takt::test::at_scale(500));
  CHECK(stalls >= takt::test::at_scale(20));
  CHECK(unexplained >= takt::test::at_scale(2));
  for (const Cause cause : {Cause::late, Cause::behind, Cause::lane, Cause::preempted, Cause::throttled, Cause::asleep,
                            Cause::unattributed, Cause::running})
    CHECK(met[cause] >= takt::test::at_scale(20));
}
