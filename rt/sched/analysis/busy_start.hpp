// SPDX-License-Identifier: Apache-2.0
// What the analyses share: which jobs a busy interval takes in, where it may begin, and fixed points.
//
// A busy interval begins at an instant `start` just before which no job that matters is pending. It then takes in all
// jobs that become ready at or after `start`. The worst that a task can do to it, whatever the policy:
//   with offset    every job planned at r >= start - jitter, ready at max(r, start): delayed until the interval begins
//                  where that is possible, and ready at once afterwards;
//   sporadic       jobs planned at start - jitter + k * period, ready at max of that and start.
// Both are one line of planned releases `first + k * period`, so that counting jobs is a division.
#pragma once
#include <algorithm>
#include <optional>
#include <vector>

#include "rt/sched/analysis/integers.hpp"
#include "rt/sched/analysis/task_set.hpp"

namespace takt::analysis {

struct BusyStart {
  Ticks start = 0;
  std::vector<Ticks> first = {};  ///< per task: planned release of the first job taken in

  /// Tasks with offsets count as if they had always run: the first hyperperiods hold no job that later ones lack.
  BusyStart(const std::vector<TimedTask>& tasks, Ticks start);
  /// Jobs of a task planned up to and including `last`.
  int64_t jobs(const TimedTask& task, size_t index, Ticks last) const {
    return last < first[index] ? 0 : (last - first[index]) / task.period + 1;
  }
  /// Their execution time.
  Wide work(const TimedTask& task, size_t index, Ticks last) const {
    return Wide{task.budget} * jobs(task, index, last);
  }
};

/// Work that an analysis may still do, so that it ends on any input: one unit per task looked at.
struct Effort {
  int64_t left = 20'000'000;
  bool spend(size_t units) { return (left -= static_cast<int64_t>(units)) > 0; }
};

/// Where a worst busy interval may begin, and how far the candidate before that lies back.
struct Candidate {
  Ticks at = 0;
  Ticks gap = 0;
};

/// Candidates within one hyperperiod of the tasks with offsets: the latest ready instants (release + jitter) of their
/// jobs, ascending; only 0 without such tasks. Nothing where there are more than a million, or the hyperperiod exceeds
/// kLongest.
std::optional<std::vector<Candidate>> busy_starts(const std::vector<TimedTask>& tasks);

/// The same tasks with their offsets forgotten: each analysis of these bounds that of `tasks`.
std::vector<TimedTask> as_sporadic(std::vector<TimedTask> tasks);

/// Those whose releases are fixed to one another.
std::vector<TimedTask> tasks_with_offsets(const std::vector<TimedTask>& tasks);

/// Least w >= from with work(w) <= w, for non-decreasing work; nothing beyond kLongest or the effort.
template <class Work>
std::optional<Ticks> fixed_point(Ticks from, size_t units, Effort& effort, const Work& work) {
  for (Ticks w = from; effort.spend(units);) {
    const Wide next = work(w);
    if (next <= w) return w;
    if (next > kLongest) return std::nullopt;
    w = static_cast<Ticks>(next);
  }
  return std::nullopt;
}

/// How far from its beginning a busy interval of all tasks, `blocking` in front, has to be looked at: until nothing is
/// pending, at most one common period of all tasks. Work within a length that is one common period longer is at most
/// one common period more (utilisation at most 1), so a job planned that much later neither ends later relative to its
/// release nor misses its deadline where the earlier one does not. Nothing beyond the range or for a utilisation
/// above 1.
std::optional<Ticks> busy_length(const std::vector<TimedTask>& tasks, const BusyStart& busy, Ticks blocking,
                                 Effort& effort);

}  // namespace takt::analysis
