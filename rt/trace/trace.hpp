// SPDX-License-Identifier: Apache-2.0
// A trace as plain data: what ran when, and who had the CPUs meanwhile. All instants CLOCK_MONOTONIC, ns.
#pragma once
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "rt/trace/event.hpp"

namespace takt::trace {

/// Where the knowledge of who had a CPU comes from.
enum class Source : uint8_t {
  tracefs,     ///< sched_switch of every CPU: names who ran instead
  perf,        ///< PERF_RECORD_SWITCH of our own threads: when they did not run, and which of them did
  simulation,  ///< the schedule of a run in virtual time: everything
  none         ///< the CPU clock of each thread alone: how long they did not run
};
const char* to_string(Source source);
/// True if the slices of every CPU are known, not only those of our own threads.
inline bool knows_every_cpu(Source source) { return source == Source::tracefs || source == Source::simulation; }

struct Latched {
  uint8_t edge = 0;  ///< index into the task's edges
  uint64_t sequence = 0;
  int64_t stamp_ns = 0;
};
struct Published {
  uint8_t output = 0;
  uint64_t sequence = 0;
  int64_t stamp_ns = 0;
};

/// One finished job.
struct JobSpan {
  uint32_t job = 0;
  uint16_t task = 0;
  int level = 0;
  int32_t thread = 0;  ///< id of the thread that ran it
  int start_cpu = -1, cpu = -1;
  int64_t release_ns = 0, deadline_ns = 0, start_ns = 0, finish_ns = 0, published_ns = 0;
  int64_t cpu_ns = 0;  ///< by its thread's CPU clock
  bool late = false;
  std::vector<Latched> latched;
  std::vector<Published> published;
};

/// One stretch of time in which a thread had a CPU.
struct Slice {
  enum class End : uint8_t { preempted, asleep, open };  ///< open: it still ran when the trace ended
  int64_t from_ns = 0, to_ns = 0;
  int64_t woken_ns = 0;  ///< when it was woken for this stretch; 0: not known, or it had only been preempted
  int32_t thread = 0;
  int32_t priority = 0;  ///< the kernel's: < 0 deadline, 0..98 real time, 100..139 ordinary
  int32_t cpu = -1;
  uint32_t name = 0;  ///< index into Trace::names
  End end = End::open;
};

/// A skipped release, a budget overrun, a change of level or mode.
struct Mark {
  Kind kind = Kind::skip;
  int64_t at_ns = 0, value = 0, extra = 0;
  uint32_t job = 0;
  uint16_t task = kNoTask;
};

/// Time that the host took from a CPU, as the kernel's counter says. It counts in ticks, at the next timer interrupt of
/// that CPU: what was taken shows up to a tick late, and may be a tick more or less.
struct Steal {
  int64_t from_ns = 0, to_ns = 0, stolen_ns = 0;
  int cpu = -1;
};
inline constexpr int64_t kStealTickNs = 10'000'000;

struct EdgeFacts {
  std::string input;
  size_t port = 0;  ///< index into Trace::ports
};
struct TaskFacts {
  std::string name;
  size_t lane = 0;
  int64_t deadline_ns = 0, budget_ns = 0;
  bool high = false;
  std::vector<EdgeFacts> edges;
  std::vector<size_t> ports;  ///< per output: index into Trace::ports
};
struct ThreadFacts {
  int32_t id = 0;
  std::string name;
};

struct Losses {
  uint64_t events = 0;     ///< of jobs, that found a ring full
  uint64_t switches = 0;   ///< that the kernel dropped
  uint64_t forgotten = 0;  ///< oldest records given up to stay within the memory limit
  uint64_t threads = 0;    ///< that found no ring
};

struct Trace {
  std::string policy;       ///< granted
  std::string source_note;  ///< why no better source was used; "" if the best one was
  Source source = Source::none;
  int64_t epoch_ns = 0, end_ns = 0;
  int64_t first_ns = std::numeric_limits<int64_t>::min();  ///< nothing is known of what was before
  std::vector<TaskFacts> tasks;
  std::vector<std::string> ports;  ///< "stereo.disparity"
  std::vector<ThreadFacts> threads;
  std::vector<std::string> names;  ///< of threads that had a CPU
  std::vector<JobSpan> jobs;       ///< by start
  std::vector<Slice> slices;       ///< by start
  std::vector<Mark> marks;         ///< by instant
  std::vector<Steal> steals;       ///< by start; only those with stolen time
  Losses losses;
};

}  // namespace takt::trace
