// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/analysis/fixed_priority.hpp"

#include <limits>

#include "rt/sched/analysis/busy_start.hpp"

namespace takt::analysis {
namespace {

/// A task behind all tasks of its core that may preempt it.
struct Level {
  std::vector<TimedTask> tasks;  ///< the analysed one last
  Ticks look_until = 0;          ///< its jobs planned this long after the first one repeat earlier ones

  const TimedTask& own() const { return tasks.back(); }
};

Level level_of(const std::vector<TimedTask>& tasks, size_t analysed) {
  Level level;
  for (size_t i = 0; i < tasks.size(); ++i) {
    if (i != analysed && tasks[i].priority >= tasks[analysed].priority) level.tasks.push_back(tasks[i]);
  }
  level.tasks.push_back(tasks[analysed]);
  level.look_until = common_period(level.tasks).value_or(kLongest);
  return level;
}

/// Longest response of the analysed task's jobs in the busy period of its level that begins at `start`; 0 if it has
/// none there.
std::optional<Ticks> response_from(const Level& level, Ticks start, Effort& effort) {
  const TimedTask& own = level.own();
  const size_t above = level.tasks.size() - 1;
  const BusyStart busy(level.tasks, start);
  const auto finish = [&](Ticks from, int64_t jobs) {  // of so many own jobs, from the start
    return fixed_point(from, level.tasks.size(), effort, [&](Ticks length) {
      Wide work = own.blocking + Wide{own.budget} * jobs;
      for (size_t i = 0; i < above; ++i) work += busy.work(level.tasks[i], i, start + length - 1);
      return work;
    });
  };
  Ticks longest = 0;
  Ticks planned = busy.first.back();
  std::optional<Ticks> pending_until = planned <= start ? 0 : finish(1, 0);
  for (int64_t jobs = 1; pending_until; ++jobs, planned += own.period) {
    if (planned > start && planned >= start + *pending_until) return longest;  // the next busy period's business
    if (planned - busy.first.back() >= level.look_until) return longest;
    pending_until = finish(std::max(Ticks{1}, *pending_until), jobs);
    if (pending_until) longest = std::max(longest, start + *pending_until - planned);
  }
  return std::nullopt;
}

std::optional<Ticks> response_of(const Level& level, const std::vector<Candidate>& starts) {
  Effort effort;
  Ticks longest = 0;
  for (const Candidate& start : starts) {
    const std::optional<Ticks> response = response_from(level, start.at, effort);
    if (!response) return std::nullopt;
    longest = std::max(longest, *response);
  }
  return longest;
}

ResponseBounds responses_of(const std::vector<TimedTask>& tasks) {
  ResponseBounds answer;
  for (size_t i = 0; i < tasks.size(); ++i) {
    const Level level = level_of(tasks, i);
    const std::optional<int> load = compare_utilisation_with_one(level.tasks);
    std::optional<Ticks> bound;
    if (!load) answer.exact = false;
    if (load && *load <= 0) {
      if (const auto starts = busy_starts(level.tasks)) bound = response_of(level, *starts);
      if (!bound) {
        answer.exact = false;
        bound = response_of({as_sporadic(level.tasks), level.look_until}, {Candidate{}});
      }
    }
    answer.bounds.push_back(bound);
  }
  return answer;
}

}  // namespace

ResponseBounds fixed_priority_responses(const std::vector<TimedTask>& tasks) {
  std::vector<TimedTask> behind = tasks, before = tasks;
  bool any = false;
  for (size_t i = 0; i < tasks.size(); ++i) {
    if (!tasks[i].deferrable) continue;
    any = true;
    behind[i].priority = std::numeric_limits<int>::min();
    before[i].priority = std::numeric_limits<int>::max();
    before[i].jitter += tasks[i].period - tasks[i].budget;
  }
  ResponseBounds answer = responses_of(behind);
  bool deferred = true;
  for (size_t i = 0; i < tasks.size(); ++i)
    deferred = deferred && (!tasks[i].deferrable || (answer.bounds[i] && *answer.bounds[i] <= tasks[i].deadline));
  if (!any || deferred) return answer;
  answer = responses_of(before);
  answer.exact = false;
  return answer;
}

}  // namespace takt::analysis
