// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/analysis/busy_start.hpp"

#include <iterator>

namespace takt::analysis {

BusyStart::BusyStart(const std::vector<TimedTask>& tasks, Ticks at) : start(at) {
  first.reserve(tasks.size());
  for (const TimedTask& task : tasks) {
    const Ticks earliest = start - task.jitter;
    first.push_back(task.sporadic ? earliest : earliest + floor_mod(task.offset - earliest, task.period));
  }
}

std::optional<std::vector<Candidate>> busy_starts(const std::vector<TimedTask>& tasks) {
  constexpr int64_t kMost = 1'000'000;
  const std::vector<TimedTask> fixed = tasks_with_offsets(tasks);
  if (fixed.empty()) return std::vector<Candidate>{{0, kLongest}};
  const std::optional<Ticks> common = common_period(fixed);
  if (!common) return std::nullopt;
  std::vector<Ticks> starts;
  for (const TimedTask& task : fixed) {
    if (*common / task.period > kMost - static_cast<int64_t>(starts.size())) return std::nullopt;
    const Ticks first = floor_mod(task.offset + task.jitter, task.period);
    for (Ticks start = first; start < *common; start += task.period) starts.push_back(start);
  }
  std::sort(starts.begin(), starts.end());
  starts.erase(std::unique(starts.begin(), starts.end()), starts.end());
  std::vector<Candidate> candidates;
  Ticks before = starts.back() - *common;
  for (const Ticks start : starts) {
    candidates.push_back({start, start - before});
    before = start;
  }
  return candidates;
}

std::vector<TimedTask> as_sporadic(std::vector<TimedTask> tasks) {
  for (TimedTask& task : tasks) {
    task.sporadic = true;
    task.offset = 0;
  }
  return tasks;
}

std::vector<TimedTask> tasks_with_offsets(const std::vector<TimedTask>& tasks) {
  std::vector<TimedTask> fixed;
  std::copy_if(tasks.begin(), tasks.end(), std::back_inserter(fixed),
               [](const TimedTask& task) { return !task.sporadic; });
  return fixed;
}

std::optional<Ticks> busy_length(const std::vector<TimedTask>& tasks, const BusyStart& busy, Ticks blocking,
                                 Effort& effort) {
  const std::optional<int> load = compare_utilisation_with_one(tasks);
  if (!load || *load > 0) return std::nullopt;
  const std::optional<Ticks> common = common_period(tasks);
  const Ticks enough = common.value_or(kLongest);
  return fixed_point(1, tasks.size(), effort, [&](Ticks length) {
    Wide work = blocking;
    for (size_t i = 0; i < tasks.size(); ++i) work += busy.work(tasks[i], i, busy.start + length - 1);
    return std::min(work, Wide{enough});
  });
}

}  // namespace takt::analysis
