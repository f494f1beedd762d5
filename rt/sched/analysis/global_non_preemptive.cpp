// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/analysis/global_non_preemptive.hpp"

#include <algorithm>
#include <limits>
#include <map>

namespace takt::analysis {
namespace {

constexpr Ticks kNever = std::numeric_limits<Ticks>::max();

struct Interval {
  Ticks earliest = 0, latest = 0;
};

struct TimedJob {
  size_t task;
  Interval ready;  ///< planned release, plus jitter
  Ticks budget, deadline;
  Ticks finish = -1;  ///< latest found
};

/// Jobs that have been started: all before `first`, and those whose bit is set from there on.
struct Started {
  size_t first = 0;
  uint64_t later = 0;
  auto operator<=>(const Started&) const = default;

  bool has(size_t job) const { return job < first || (job - first < 64 && (later >> (job - first) & 1) != 0); }
  /// False if the job lies too far ahead to be noted.
  bool add(size_t job) {
    if (job - first >= 64) return false;
    later |= uint64_t{1} << (job - first);
    while ((later & 1) != 0) {
      later >>= 1;
      ++first;
    }
    return true;
  }
};

/// When the first, second, ... worker becomes free.
using Workers = std::vector<Interval>;

class Exploration {
 public:
  Exploration(std::vector<TimedJob>& jobs, size_t workers, size_t max_states)
      : jobs_(jobs), workers_(workers), max_states_(max_states) {}

  /// The job that may be late or could not be looked at; nullptr if all are in time and known.
  const TimedJob* first_late(std::string& why) {
    Level level;
    level[{}].push_back(Workers(workers_));
    size_t states = 0;
    for (size_t started = 0; started < jobs_.size(); ++started) {
      Level next;
      for (const auto& [set, choices] : level)
        for (const Workers& free : choices) {
          if (++states > max_states_) return why = "more states than are looked at", &jobs_[set.first];
          if (const TimedJob* job = start_one(set, free, next, why)) return job;
        }
      level = std::move(next);
    }
    return nullptr;
  }

 private:
  using Level = std::map<Started, std::vector<Workers>>;

  bool before(const TimedJob& a, const TimedJob& b) const {
    return a.deadline != b.deadline ? a.deadline < b.deadline : a.task < b.task;
  }

  /// Every job that may be the next to start, each leading to a state of the next level.
  const TimedJob* start_one(const Started& set, const Workers& free, Level& next, std::string& why) {
    Ticks all_ready = kNever;  // when some job is surely ready
    for (size_t j = set.first; j < jobs_.size(); ++j) {
      if (jobs_[j].ready.earliest >= all_ready) break;  // sorted by release
      if (!set.has(j)) all_ready = std::min(all_ready, jobs_[j].ready.latest);
    }
    const Ticks forced = std::max(free.front().latest, all_ready);  // no worker idles beyond
    for (size_t j = set.first; j < jobs_.size() && jobs_[j].ready.earliest <= forced; ++j) {
      if (set.has(j)) continue;
      TimedJob& job = jobs_[j];
      Ticks outranked = kNever;  // a job that goes before it is surely ready
      for (size_t o = set.first; o < jobs_.size() && jobs_[o].ready.earliest <= forced; ++o)
        if (o != j && !set.has(o) && before(jobs_[o], job)) outranked = std::min(outranked, jobs_[o].ready.latest);
      const Ticks earliest = std::max(job.ready.earliest, free.front().earliest);
      const Ticks latest = std::min(forced, outranked - 1);
      if (earliest > latest) continue;
      job.finish = std::max(job.finish, latest + job.budget);
      if (job.finish > job.deadline) return &job;
      Started then = set;
      if (!then.add(j)) return why = "too many jobs wait at once", &job;
      merge(next[then], after(free, earliest, latest, job.budget));
    }
    return nullptr;
  }

  static Workers after(const Workers& free, Ticks earliest, Ticks latest, Ticks budget) {
    std::vector<Ticks> possible{earliest}, certain{latest + budget};
    for (size_t w = 1; w < free.size(); ++w) {
      possible.push_back(std::max(earliest, free[w].earliest));
      certain.push_back(std::max(earliest, free[w].latest));
    }
    std::sort(possible.begin(), possible.end());
    std::sort(certain.begin(), certain.end());
    Workers result(free.size());
    for (size_t w = 0; w < free.size(); ++w) result[w] = {possible[w], certain[w]};
    return result;
  }

  /// States after the same jobs whose intervals overlap become one that covers both.
  static void merge(std::vector<Workers>& states, Workers added) {
    for (bool again = true; again;) {
      again = false;
      for (size_t s = 0; s < states.size(); ++s) {
        bool overlap = true;
        for (size_t w = 0; w < added.size() && overlap; ++w)
          overlap = states[s][w].earliest <= added[w].latest && added[w].earliest <= states[s][w].latest;
        if (!overlap) continue;
        for (size_t w = 0; w < added.size(); ++w)
          added[w] = {std::min(states[s][w].earliest, added[w].earliest),
                      std::max(states[s][w].latest, added[w].latest)};
        states.erase(states.begin() + static_cast<ptrdiff_t>(s));
        again = true;
        break;
      }
    }
    states.push_back(std::move(added));
  }

  std::vector<TimedJob>& jobs_;
  const size_t workers_, max_states_;
};

std::vector<TimedJob> jobs_until(const TaskSet& set, Ticks end) {
  std::vector<TimedJob> jobs;
  for (size_t t = 0; t < set.tasks.size(); ++t) {
    const TimedTask& task = set.tasks[t];
    for (Ticks at = task.offset; at < end; at += task.period)
      jobs.push_back({t, {at, at + task.jitter}, task.budget + task.blocking, at + task.deadline});
  }
  std::stable_sort(jobs.begin(), jobs.end(),
                   [](const TimedJob& a, const TimedJob& b) { return a.ready.earliest < b.ready.earliest; });
  return jobs;
}

/// An instant in [first, first + period] at which, and a period later, whatever was released before is done.
bool comes_to_rest(const std::vector<TimedJob>& jobs, Ticks first, Ticks period) {
  const auto done_at = [&](Ticks instant) {
    return std::all_of(jobs.begin(), jobs.end(),
                       [&](const TimedJob& job) { return job.ready.earliest >= instant || job.finish <= instant; });
  };
  return std::any_of(jobs.begin(), jobs.end(), [&](const TimedJob& job) {
    const Ticks instant = job.ready.earliest;
    return instant >= first && instant <= first + period && done_at(instant) && done_at(instant + period);
  });
}

}  // namespace

CoreAnalysis global_non_preemptive_edf(const TaskSet& set, size_t max_states) {
  CoreAnalysis answer;
  answer.responses = {std::vector<std::optional<Ticks>>(set.tasks.size()), false};
  answer.why = defect(set);
  if (!answer.why.empty()) return answer;
  constexpr double kMostJobs = 20'000;
  Ticks last_offset = 0;
  double jobs_a_tick = 0;
  for (const TimedTask& task : set.tasks) {
    if (task.sporadic) return answer.why = "task '" + task.name + "' has no planned releases", answer;
    last_offset = std::max(last_offset, task.offset);
    jobs_a_tick += 1 / static_cast<double>(task.period);
  }
  const std::optional<Ticks> period = set.hyperperiod();
  if (!period || (2 * static_cast<double>(*period) + static_cast<double>(last_offset)) * jobs_a_tick > kMostJobs)
    return answer.why = "too many jobs until everything repeats", answer;
  std::vector<TimedJob> jobs = jobs_until(set, last_offset + 2 * *period);
  std::string unknown;
  if (const TimedJob* late = Exploration(jobs, static_cast<size_t>(set.cores), max_states).first_late(unknown)) {
    answer.why = unknown.empty() ? "task '" + set.tasks[late->task].name + "' may be late" : unknown;
    return answer;
  }
  if (!comes_to_rest(jobs, last_offset, *period))
    return answer.why = "there is no instant at which all work is surely done", answer;
  for (const TimedJob& job : jobs) {
    std::optional<Ticks>& response = answer.responses.bounds[job.task];
    response = std::max(response.value_or(0), job.finish - job.ready.earliest);
  }
  answer.verdict = Verdict::schedulable;
  return answer;
}

}  // namespace takt::analysis
