// SPDX-License-Identifier: Apache-2.0
// What a run counts. Plain data without pointers: it lies in memory that the processes of a run share, so that nobody
// has to be asked for it and a process that dies leaves its figures behind.
#pragma once
#include <array>
#include <atomic>
#include <cstdint>

#include "rt/hot.hpp"
#include "rt/level.hpp"
#include "rt/memory/job_calls.hpp"
#include "rt/sched/histogram.hpp"
#include "rt/sched/plan.hpp"
#include "rt/sched/proof_log.hpp"

namespace takt {

/// Where one thread counts, and the others only look.
inline void add(std::atomic<uint64_t>& counter, uint64_t by = 1) {
  counter.store(counter.load(std::memory_order_relaxed) + by, std::memory_order_relaxed);
}

/// Where one thread keeps the largest value, and the others only look.
inline void keep_largest(std::atomic<int64_t>& largest, int64_t value) {
  if (value > largest.load(std::memory_order_relaxed)) largest.store(value, std::memory_order_relaxed);
}

/// One finished job, for timelines.
struct JobRecord {
  int64_t release_ns = 0, start_ns = 0, finish_ns = 0;
  int32_t cpu = -1;  ///< where it finished
};

/// From the job released then on, the level is that one.
struct LevelChange {
  int64_t release_ns = 0;
  int32_t level = 0;
};

/// What the jobs of one task did. Written by the thread that runs the task; the atomics may be read at any time.
struct alignas(kCacheLine) TaskStatistics {
  std::atomic<uint64_t> released{0};  ///< of `on` tasks only; a rate's releases are computed outside the executor
  std::atomic<uint64_t> paused{0};    ///< releases at which requests did not let the task run
  std::atomic<uint64_t> completed{0}, skipped{0}, reused{0}, deadline_misses{0}, budget_overruns{0}, stale_inputs{0};
  std::atomic<uint64_t> new_inputs{0};  ///< jobs whose first input was new: distinct input stamps
  std::atomic<uint64_t> no_result{0};
  std::atomic<uint64_t> in_job{0};  ///< 1 + number of the job under way; 0: none. Stays where a job ended its process
  std::atomic<int64_t> enforcement_error_ns{0};  ///< most CPU time beyond its budget that a job had when it was demoted
  std::atomic<uint64_t> demoted{0};  ///< jobs that used up their budget and gave way to all others; by the watchdog
  std::atomic<uint64_t> lifted{0};   ///< jobs that went on beside a reservation that was used up; likewise
  std::array<std::atomic<uint64_t>, kMaxLevels> at_level{};  ///< jobs by quality level
  std::atomic<int32_t> last_level{0};
  std::atomic<int64_t> last_exec_ns{0}, last_response_ns{0}, largest_response_ns{0};
  uint64_t allocations = 0, page_faults = 0;
  std::array<uint64_t, kJobCalls> rt_violations{};  ///< by JobCall: calls that no job should make, once it is warm
  int64_t cpu_ns = 0, preempted_ns = 0;
  Histogram lateness, exec, response, publish;
  ProofBound response_bound;
  std::array<JobRecord, 64> jobs{};        ///< ring of the last ones
  std::atomic<uint64_t> job_count{0};      ///< written so far
  std::array<LevelChange, 64> changes{};   ///< ring of the last ones
  std::atomic<uint64_t> level_changes{0};  ///< written so far

  /// Drift of the release grid: least lateness of the last 100 jobs minus that of the first 100, us. Zero if releases
  /// stay on the planned instants, however long the run.
  double drift_us() const;
  void add_lateness(int64_t ns);

 private:
  static constexpr size_t kWindow = 100;
  std::array<int64_t, kWindow> first_{}, last_{};
};

/// What one edge carried. Every message sent is received, superseded before a job latched it (dropped), or waiting.
struct alignas(kCacheLine) EdgeStatistics {
  uint64_t received = 0, dropped = 0;
  std::atomic<uint64_t> stale{0};
  uint64_t damaged = 0;  ///< messages that were lost since their own process had written over them
  uint64_t last_seen =
      0;  ///< sequence of the newest message latched: whoever takes a dead reader's place goes on there
  std::atomic<uint64_t> in_hand{0};  ///< sequence of the newest message that the job under way has latched
  /// Messages that no job latches: those of them ended its process twice. By the supervisor, while there is none.
  std::atomic<uint64_t> pass_over_from{0}, pass_over_to{0};
  std::atomic<uint64_t> passed_over{0};  ///< how many there were so far
  Histogram age;                         ///< stamp to job start, of the newest latched message
  ProofBound age_bound;
};

/// What one output gave.
struct alignas(kCacheLine) PortStatistics {
  std::atomic<uint64_t> published{0};  ///< sequence of the newest message, stored before it is out
  Histogram age;                       ///< stamp of a message to the instant from which consumers may see it
  std::atomic<int64_t> last_age_ns{0}, largest_age_ns{0};  ///< of these, for who looks on
  ProofBound age_bound;
  WriterStatistics writer;  ///< at the end of the run, before anything is torn down
};

/// What the kernel granted the thread that runs a task: Grant without pointers.
struct alignas(kCacheLine) GrantRecord {
  Policy policy = Policy::cooperative;
  bool verified = false;
  int priority = 0;
  double runtime_ms = 0, deadline_ms = 0;
  std::array<uint64_t, 16> cpus{};  ///< one bit a CPU
  BoundedText<512> refused;
};

}  // namespace takt
