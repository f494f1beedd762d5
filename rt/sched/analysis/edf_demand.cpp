// SPDX-License-Identifier: Apache-2.0
#include <limits>
#include <map>

#include "rt/sched/analysis/busy_start.hpp"
#include "rt/sched/analysis/edf.hpp"
#include "rt/sched/analysis/edf_blocking.hpp"

namespace takt::analysis {
namespace {

/// One question to the demand: can the deadlines in [from, before) be met with this in front?
struct Query {
  Ticks blocking = 0;
  Ticks from = 0;
  Ticks before = 0;
};

std::optional<Ticks> latest_deadline(const std::vector<TimedTask>& tasks, const BusyStart& busy, const Query& query,
                                     Ticks before) {
  std::optional<Ticks> latest;
  for (size_t i = 0; i < tasks.size(); ++i) {
    const TimedTask& task = tasks[i];
    const Ticks room = before - 1 - task.deadline - busy.first[i];
    if (room < 0) continue;
    const Ticks due = busy.first[i] + room / task.period * task.period + task.deadline;
    if (due >= query.from && (!latest || due > *latest)) latest = due;
  }
  return latest;
}

/// QPA, downwards. False: the effort is used up.
bool look_down(const std::vector<TimedTask>& tasks, const BusyStart& busy, const Query& query, Effort& effort,
               std::optional<Overload>& overload) {
  Ticks before = query.before;
  while (const std::optional<Ticks> due = latest_deadline(tasks, busy, query, before)) {
    if (!effort.spend(tasks.size())) return false;
    Wide demand = query.blocking;
    for (size_t i = 0; i < tasks.size(); ++i) demand += busy.work(tasks[i], i, *due - tasks[i].deadline);
    if (demand > *due - busy.start) {
      const Wide shown = std::min(demand, Wide{std::numeric_limits<Ticks>::max()});
      overload = Overload{busy.start, *due - busy.start, static_cast<Ticks>(shown)};
      return true;
    }
    before = std::min(*due, busy.start + static_cast<Ticks>(demand));
  }
  return true;
}

/// Everything that has to be asked of one start. `slack`: see blocks_deadlines_before.
std::optional<std::vector<Query>> queries(const std::vector<TimedTask>& tasks, const BusyStart& busy, bool preemptive,
                                          Ticks slack, Effort& effort) {
  std::map<Ticks, Ticks> from;  // by blocking: a task that has it may be due at any instant this long after the start
  Ticks longest = 0;
  for (const TimedTask& task : tasks) {
    const auto [least, is_new] = from.try_emplace(task.blocking, task.deadline - task.jitter);
    if (!is_new) least->second = std::min(least->second, task.deadline - task.jitter);
    longest = std::max({longest, task.blocking, preemptive ? 0 : task.budget - 1});
  }
  const std::optional<Ticks> length = busy_length(tasks, busy, longest, effort);
  if (!length) return std::nullopt;
  const Ticks end = busy.start + *length + 1;
  std::vector<Query> all;
  for (const auto& [blocking, due] : from) all.push_back({blocking, busy.start + due, end});
  if (preemptive) return all;
  for (const TimedTask& task : tasks) {
    if (task.budget > 1) {
      all.push_back(
          {task.budget - 1, busy.start - kLongest, std::min(end, blocks_deadlines_before(task, busy.start, slack))});
    }
  }
  return all;
}

enum class Outcome { fits, overloaded, gave_up };

Outcome look_from_all(const std::vector<TimedTask>& tasks, bool preemptive, std::optional<Overload>& overload) {
  const auto starts = busy_starts(tasks);
  if (!starts) return Outcome::gave_up;
  const bool moves =
      tasks_with_offsets(tasks).size() < tasks.size();  // sporadic tasks: the interval may begin before a start
  Effort effort;
  for (const Candidate& start : *starts) {
    const BusyStart busy(tasks, start.at);
    const auto all = queries(tasks, busy, preemptive, moves ? start.gap - 1 : 0, effort);
    if (!all) return Outcome::gave_up;
    for (const Query& query : *all) {
      if (!look_down(tasks, busy, query, effort, overload)) return Outcome::gave_up;
      if (overload) return Outcome::overloaded;
    }
  }
  return Outcome::fits;
}

DemandAnswer demand_test(const std::vector<TimedTask>& tasks, bool preemptive, bool exact) {
  const std::optional<int> load = compare_utilisation_with_one(tasks);
  if (load && *load > 0) return {Verdict::not_schedulable};
  if (!load) return {Verdict::not_proven};
  DemandAnswer answer;
  Outcome outcome = look_from_all(tasks, preemptive, answer.overload);
  if (outcome == Outcome::gave_up) {
    exact = exact && tasks_with_offsets(tasks).empty();
    outcome = look_from_all(as_sporadic(tasks), preemptive, answer.overload);
  }
  if (outcome == Outcome::fits) answer.verdict = Verdict::schedulable;
  if (outcome == Outcome::overloaded && exact) answer.verdict = Verdict::not_schedulable;
  return answer;
}

bool unequal_blocking(const std::vector<TimedTask>& tasks) {
  return std::any_of(tasks.begin(), tasks.end(),
                     [&](const TimedTask& task) { return task.blocking != tasks.front().blocking; });
}

}  // namespace

DemandAnswer edf_demand_test(const std::vector<TimedTask>& tasks) {
  if (tasks_with_offsets(tasks).size() > 1 && unequal_blocking(tasks)) return {verdict_of(tasks, edf_responses(tasks))};
  return demand_test(tasks_with_offsets(tasks).size() > 1 ? tasks : as_sporadic(tasks), true, true);
}

DemandAnswer non_preemptive_edf_demand_test(const std::vector<TimedTask>& tasks) {
  const bool offsets = tasks_with_offsets(tasks).size() > 1;
  return demand_test(offsets ? tasks : as_sporadic(tasks), false, !offsets);
}

}  // namespace takt::analysis
