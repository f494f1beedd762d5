// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/analysis/task_set.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

#include "rt/sched/analysis/integers.hpp"

namespace takt::analysis {
namespace {

std::optional<Ticks> common_period_up_to(const std::vector<TimedTask>& tasks, Ticks limit) {
  Ticks all = 1;
  for (const TimedTask& task : tasks) {
    if (task.period <= 0) return std::nullopt;
    const Wide next = Wide{all / std::gcd(all, task.period)} * task.period;
    if (next > limit) return std::nullopt;
    all = static_cast<Ticks>(next);
  }
  return all;
}

std::string defect(const TimedTask& task, int cores) {
  const auto says = [&](const char* what) { return "task '" + task.name + "': " + what; };
  for (const Ticks time : {task.period, task.deadline, task.budget, task.offset, task.jitter, task.blocking}) {
    if (time < 0) return says("a time is negative");
    if (time > kLongest) return says("a time is too long for an analysis");
  }
  if (task.period == 0) return says("the period is not above 0");
  if (task.budget == 0) return says("the budget is not above 0");
  if (task.deadline == 0) return says("the deadline is not above 0");
  if (task.deadline > task.period) return says("the deadline is above the period");
  if (task.sporadic && task.offset != 0) return says("a sporadic task has no offset");
  if (task.core < -1 || task.core >= cores) return says("the core does not exist");
  return {};
}

}  // namespace

std::optional<Ticks> TaskSet::hyperperiod() const {
  if (tasks.empty()) return std::nullopt;
  return common_period_up_to(tasks, std::numeric_limits<Ticks>::max());
}

double TaskSet::utilisation() const {
  double sum = 0;
  for (const TimedTask& task : tasks) sum += static_cast<double>(task.budget) / static_cast<double>(task.period);
  return sum;
}

std::optional<Ticks> common_period(const std::vector<TimedTask>& tasks) { return common_period_up_to(tasks, kLongest); }

std::string defect(const TaskSet& set) {
  if (set.cores < 1) return "there is no core";
  for (const TimedTask& task : set.tasks) {
    if (std::string text = defect(task, set.cores); !text.empty()) return text;
  }
  return {};
}

std::optional<int> compare_utilisation_with_one(const std::vector<TimedTask>& tasks) {
  // Bounds in units of 2^-60 first: they decide almost always and need no common denominator.
  const Wide one = Wide{1} << 60;
  Wide below = 0, above = 0;
  for (const TimedTask& task : tasks) {
    const Wide scaled = Wide{task.budget} << 60;
    below += scaled / task.period;
    above += (scaled + task.period - 1) / task.period;
  }
  if (above < one) return -1;
  if (below > one) return 1;
  const std::optional<Ticks> common = common_period(tasks);
  if (!common) return std::nullopt;
  Wide sum = 0;
  for (const TimedTask& task : tasks) sum += Wide{task.budget} * (*common / task.period);
  return sum < *common ? -1 : sum > *common ? 1 : 0;
}

void assign_deadline_monotonic(TaskSet& set) {
  std::vector<size_t> order(set.tasks.size());
  std::iota(order.begin(), order.end(), size_t{0});
  const auto urgency = [&](size_t task) { return set.tasks[task].deadline - set.tasks[task].jitter; };
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) { return urgency(a) < urgency(b); });
  int priority = static_cast<int>(order.size());
  for (const size_t task : order) set.tasks[task].priority = priority--;
}

}  // namespace takt::analysis
