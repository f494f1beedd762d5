// SPDX-License-Identifier: Apache-2.0
// Where the time of a job went. Pure functions on a trace: they read no clock and no kernel file.
#pragma once
#include <map>
#include <string>
#include <vector>

#include "rt/trace/trace.hpp"

namespace takt::trace {

enum class Cause : uint8_t {
  late,          ///< released late: the timer, or the way from the wake-up to the job
  behind,        ///< released late behind `who`, which had the CPU
  lane,          ///< waited for `who`, which its lane runs before it (its own previous job, too)
  queue,         ///< waited for `who`, which ran on its worker and is not preempted (cooperative)
  preempted,     ///< `who` had its CPU ("": the source names nobody)
  throttled,     ///< kept off the CPU by the kernel: its SCHED_DEADLINE reservation was used up
  asleep,        ///< slept or waited inside the job
  stall,         ///< the host had taken the CPU away
  unattributed,  ///< did not run, and nothing here says why
  budget,        ///< execution beyond its budget
  execution,     ///< execution, where the schedule states no budget
  running,       ///< only in course(): it ran
  slack          ///< what deadline and budget left; negative (positive: budget that was used beyond the deadline)
};

/// The time [from, to) of a job, and what it was spent on.
struct Piece {
  int64_t from_ns = 0, to_ns = 0;
  Cause cause = Cause::late;
  std::string who = {};
  int cpu = -1;
};

struct Part {
  Cause cause = Cause::late;
  int64_t ns = 0;
  std::string who = {};
  int cpu = -1;
};

struct Blame {
  int64_t miss_ns = 0;      ///< publication after the deadline; negative: it was in time
  std::vector<Part> parts;  ///< their sum is miss_ns, to the nanosecond; in the order of Cause, then by size
};

/// A trace with what blame looks up in it. Refers to the trace.
class Evidence {
 public:
  explicit Evidence(const Trace& trace);

  const Trace& trace() const { return trace_; }
  /// What had a CPU in [from, to), by time, without overlaps; where nobody had it there is a hole.
  std::vector<Piece> occupants(int cpu, int64_t from_ns, int64_t to_ns) const;
  /// Jobs of the same lane or the same thread that ran in [from, to), by start, `job` apart.
  std::vector<const JobSpan*> ahead_of(const JobSpan& job, int64_t from_ns, int64_t to_ns) const;
  /// Stretches in which that thread had a CPU, by time; null if the source saw none.
  const std::vector<const Slice*>* slices_of(int32_t thread) const;
  /// Time that the host took from that CPU about then.
  int64_t stolen_ns(int cpu, int64_t from_ns, int64_t to_ns) const;
  /// True if a thread other than one of SCHED_DEADLINE had that CPU at that instant, or nobody had.
  bool left_to_others(int cpu, int64_t at_ns) const;

 private:
  const Trace& trace_;
  std::map<int32_t, std::vector<const Slice*>> by_thread_;
  std::map<int, std::vector<const Slice*>> by_cpu_;
  std::map<int32_t, std::vector<const JobSpan*>> jobs_of_;
  std::map<size_t, std::vector<const JobSpan*>> jobs_of_lane_;
  std::map<int32_t, std::string> names_;
};

/// The job's time from planned release to publication: pieces without gaps or overlaps.
std::vector<Piece> course(const Evidence& evidence, const JobSpan& job);

/// Why the job was published when it was, against its deadline:
///   publication - deadline = all that kept it from running + execution over its budget - slack,
///   slack = (deadline - release) - execution within its budget.
/// Execution is the thread's CPU time; time that it had a CPU while its CPU clock stood still is the host's.
Blame blame(const Evidence& evidence, const JobSpan& job);

}  // namespace takt::trace
