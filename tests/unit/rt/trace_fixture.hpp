// SPDX-License-Identifier: Apache-2.0
// Traces written by hand: instants in us after zero.
#pragma once
#include "rt/trace/blame.hpp"
#include "tests/nanoseconds.hpp"

namespace takt::trace::by_hand {

using takt::test::kUs;

/// Two lanes: `stereo` alone on thread 11; `camera` with its follower `ground_map` on thread 12. Budgets 5 ms,
/// deadlines 10 ms. Thread 99 is `cc1plus`, no thread of ours.
inline Trace two_lanes(Source source = Source::tracefs) {
  Trace trace;
  trace.source = source;
  trace.tasks = {{"stereo", 0, 10'000 * kUs, 5'000 * kUs, true, {}, {}},
                 {"camera", 1, 10'000 * kUs, 5'000 * kUs, false, {}, {0}},
                 {"ground_map", 1, 10'000 * kUs, 5'000 * kUs, false, {{"image", 0}}, {}}};
  trace.ports = {"camera.image"};
  trace.threads = {{11, "stereo"}, {12, "camera"}};
  trace.names = {"stereo", "camera", "cc1plus"};
  return trace;
}

inline JobSpan job(uint16_t task, uint32_t number, int64_t release, int64_t start, int64_t published, int64_t cpu) {
  JobSpan span;
  span.task = task;
  span.job = number;
  span.thread = task == 0 ? 11 : 12;
  span.release_ns = release * kUs;
  span.deadline_ns = (release + 10'000) * kUs;
  span.start_ns = start * kUs;
  span.finish_ns = span.published_ns = published * kUs;
  span.cpu_ns = cpu * kUs;
  span.late = span.published_ns > span.deadline_ns;
  span.start_cpu = span.cpu = 1;
  return span;
}

inline Slice slice(int32_t thread, int cpu, int64_t from, int64_t to, Slice::End end, int64_t woken = 0,
                   int32_t priority = 50) {
  return {from * kUs, to * kUs, woken * kUs, thread, priority, cpu, thread == 99 ? 2U : thread == 11 ? 0U : 1U, end};
}

inline int64_t part_us(const Blame& blame, Cause cause, const std::string& who = "") {
  int64_t sum = 0;
  for (const Part& part : blame.parts)
    if (part.cause == cause && (who.empty() || part.who == who)) sum += part.ns;
  return sum / kUs;
}

inline int64_t sum_ns(const Blame& blame) {
  int64_t sum = 0;
  for (const Part& part : blame.parts) sum += part.ns;
  return sum;
}

}  // namespace takt::trace::by_hand
