// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/analysis/busy_start.hpp"
#include "rt/sched/analysis/edf.hpp"
#include "rt/sched/analysis/edf_blocking.hpp"

namespace takt::analysis {
namespace {

/// Longest response of one task, or of what its jobs begin with, searched over deadline busy periods.
class ResponseSearch {
 public:
  /// Of the job itself only the first `work` counts.
  ResponseSearch(const std::vector<TimedTask>& tasks, size_t own, bool preemptive, Ticks work)
      : tasks_(tasks), own_(own), preemptive_(preemptive), work_(work) {}

  std::optional<Ticks> longest() {
    const auto starts = busy_starts(tasks_);
    if (!starts || !measure_window()) return std::nullopt;
    longest_ = task().jitter + work_;
    const bool found = task().sporadic ? search_sporadic(*starts) : search_planned();
    if (!found) return std::nullopt;
    return longest_;
  }

 private:
  const TimedTask& task() const { return tasks_[own_]; }

  /// A busy interval holds no worse job that is planned more than this after its beginning.
  bool measure_window() {
    Ticks blocking = 0;
    for (const TimedTask& other : tasks_) {
      blocking = std::max({blocking, other.blocking, preemptive_ ? 0 : other.budget - 1});
    }
    const std::vector<TimedTask> together = as_sporadic(tasks_);  // no pattern is busy for longer
    const auto length = busy_length(together, BusyStart(together, 0), blocking, effort_);
    if (length) window_ = *length;
    return length.has_value();
  }

  /// A job with offset: each of one hyperperiod, with all beginnings that come into question for it.
  bool search_planned() {
    const std::optional<Ticks> common = common_period(tasks_with_offsets(tasks_));
    if (!common) return false;
    for (Ticks planned = floor_mod(task().offset, task().period); planned < *common; planned += task().period) {
      const auto starts = starts_for(planned);
      if (!starts) return false;
      for (const Ticks start : *starts) {
        if (!try_job(BusyStart(tasks_, start), planned, 0)) return false;
      }
    }
    return true;
  }

  std::optional<std::vector<Ticks>> starts_for(Ticks planned) {
    const Ticks from = planned - window_;
    const Ticks to = planned + task().jitter;
    const Ticks due = planned + task().deadline;
    std::vector<Ticks> starts;
    for (const TimedTask& other : tasks_) {
      // Latest ready instants, or instants from which the last sporadic job in time is due at `due`.
      const Ticks phase = other.sporadic ? due - other.deadline + other.jitter : other.offset + other.jitter;
      Ticks last = to - floor_mod(to - phase, other.period);
      if (other.sporadic) last = std::min(last, phase);
      for (Ticks start = last; start >= from; start -= other.period) {
        if (!effort_.spend(1)) return std::nullopt;
        starts.push_back(start);
      }
    }
    std::sort(starts.begin(), starts.end());
    starts.erase(std::unique(starts.begin(), starts.end()), starts.end());
    return starts;
  }

  /// A sporadic job: from each beginning, the arrivals that make its deadline that of another job, or that keep
  /// earlier own jobs in the interval.
  bool search_sporadic(const std::vector<Candidate>& starts) {
    for (const Candidate& start : starts) {
      const BusyStart busy(tasks_, start.at);
      const Ticks slack = start.gap - 1;
      const Ticks earliest = busy.first[own_];
      for (size_t i = 0; i < tasks_.size(); ++i) {
        Ticks planned = busy.first[i] + tasks_[i].deadline - task().deadline;
        if (planned < earliest)
          planned += (earliest - planned + tasks_[i].period - 1) / tasks_[i].period * tasks_[i].period;
        for (; planned <= busy.start + window_; planned += tasks_[i].period) {
          if (!try_job(busy, planned, slack)) return false;
        }
      }
    }
    return true;
  }

  /// False: beyond range or effort.
  bool try_job(const BusyStart& busy, Ticks planned, Ticks slack) {
    const Ticks due = planned + task().deadline;
    const Wide own_before = busy.work(task(), own_, planned) - task().budget;
    const Wide in_front = (preemptive_ ? task().blocking : blocking_at(busy, due, slack)) + own_before;
    const auto pending = [&](Ticks last_ready) {
      Wide work = in_front;
      for (size_t i = 0; i < tasks_.size(); ++i) {
        if (i != own_) work += busy.work(tasks_[i], i, std::min(last_ready, due - tasks_[i].deadline));
      }
      return work;
    };
    std::optional<Ticks> finish;
    if (preemptive_) {
      finish = fixed_point(1, tasks_.size(), effort_,
                           [&](Ticks length) { return pending(busy.start + length - 1) + work_; });
    } else {  // a job that is ready at the very start of this one goes first
      finish = fixed_point(0, tasks_.size(), effort_, [&](Ticks length) { return pending(busy.start + length); });
      if (finish) *finish += work_;
    }
    if (finish) longest_ = std::max(longest_, busy.start + *finish - planned);
    return finish.has_value();
  }

  Ticks blocking_at(const BusyStart& busy, Ticks due, Ticks slack) const {
    Ticks longest = task().blocking;
    for (size_t i = 0; i < tasks_.size(); ++i) {
      if (i != own_ && due < blocks_deadlines_before(tasks_[i], busy.start, slack)) {
        longest = std::max(longest, tasks_[i].budget - 1);
      }
    }
    return longest;
  }

  const std::vector<TimedTask>& tasks_;
  size_t own_;
  bool preemptive_;
  Ticks work_;
  Ticks window_ = 0;
  Ticks longest_ = 0;
  Effort effort_;
};

/// Where the search is beyond its range offsets are forgotten, and `exact` is false.
std::optional<Ticks> response(const std::vector<TimedTask>& tasks, size_t task, bool preemptive, Ticks work,
                              bool& exact) {
  if (const auto found = ResponseSearch(tasks, task, preemptive, work).longest()) return found;
  exact = false;
  const std::vector<TimedTask> sporadic = as_sporadic(tasks);
  return ResponseSearch(sporadic, task, preemptive, work).longest();
}

ResponseBounds responses(const std::vector<TimedTask>& tasks, bool preemptive) {
  ResponseBounds answer;
  const std::optional<int> load = compare_utilisation_with_one(tasks);
  if (!load || *load > 0) {
    answer.exact = load.has_value();
    answer.bounds.resize(tasks.size());
    return answer;
  }
  for (size_t i = 0; i < tasks.size(); ++i)
    answer.bounds.push_back(response(tasks, i, preemptive, tasks[i].budget, answer.exact));
  return answer;
}

}  // namespace

ResponseBounds edf_responses(const std::vector<TimedTask>& tasks) {
  return responses(tasks_with_offsets(tasks).size() > 1 ? tasks : as_sporadic(tasks), true);
}

std::optional<Ticks> edf_response_of_first(const std::vector<TimedTask>& tasks, size_t task, Ticks work) {
  const std::optional<int> load = compare_utilisation_with_one(tasks);
  if (!load || *load > 0) return std::nullopt;
  bool exact = true;
  return response(tasks_with_offsets(tasks).size() > 1 ? tasks : as_sporadic(tasks), task, true, work, exact);
}

ResponseBounds non_preemptive_edf_responses(const std::vector<TimedTask>& tasks) {
  const bool offsets = tasks_with_offsets(tasks).size() > 1;
  ResponseBounds answer = responses(offsets ? tasks : as_sporadic(tasks), false);
  if (offsets) answer.exact = false;
  return answer;
}

}  // namespace takt::analysis
