// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/watch_rules.hpp"

#include <algorithm>

namespace takt {

int64_t enforced_budget_ns(const TaskPlan& task) { return task.budget_ns > 0 ? task.budget_ns : task.deadline_ns / 4; }

WatchRules watch_rules(const TaskPlan& task, Policy granted, int64_t patience_ns) {
  WatchRules rules;
  rules.budget_ns = std::max<int64_t>(enforced_budget_ns(task), 1);
  rules.deadline_ns = task.deadline_ns;
  rules.patience_ns = patience_ns;
  rules.demote = granted == Policy::fixed && task.criticality == Criticality::low;
  rules.lift = granted == Policy::deadline;
  rules.low = task.criticality == Criticality::low;
  rules.stop_on_overrun = task.on_overrun == OnOverrun::safe_stop;
  rules.stop_on_miss = task.on_miss == OnMiss::safe_stop;
  return rules;
}

WatchVerdict judge_budget(const WatchRules& rules, const WatchSight& sight) {
  WatchVerdict verdict;
  verdict.look_again_ns = std::numeric_limits<int64_t>::max();
  if (!rules.minds_overrun() || (sight.running && sight.overrun_told)) return verdict;
  // A job that is still to come begins at its release, or any moment if that has passed.
  if (!sight.running && sight.release_ns > sight.now_ns) {
    verdict.look_again_ns = sight.release_ns + rules.budget_ns;
    return verdict;
  }
  const int64_t left_ns = sight.running ? sight.cpu_left_ns : rules.budget_ns;
  verdict.overrun = left_ns <= 0;
  if (!verdict.overrun)
    verdict.look_again_ns = sight.now_ns + std::max(left_ns, sight.stands ? kStandsGrain_ns : kWatchGrain_ns);
  return verdict;
}

WatchVerdict judge_clock(const WatchRules& rules, const WatchSight& sight) {
  const int64_t missed_ns = sight.release_ns + rules.deadline_ns + 1, hung_ns = missed_ns + rules.patience_ns;
  WatchVerdict verdict;
  verdict.look_again_ns = std::numeric_limits<int64_t>::max();
  const auto by_the_clock = [&](bool minds, bool told, int64_t instant_ns, bool& due) {
    if (!minds || (sight.running && told)) return;
    due = sight.running && sight.now_ns >= instant_ns;
    if (due) return;
    // A job that begins after that instant is seen within a deadline, or tells it itself when it ends.
    const int64_t next_ns = instant_ns > sight.now_ns ? instant_ns : sight.now_ns + rules.deadline_ns;
    verdict.look_again_ns = std::min(verdict.look_again_ns, next_ns);
  };
  by_the_clock(rules.stop_on_miss, sight.miss_told, missed_ns, verdict.miss);
  by_the_clock(true, sight.hang_told, hung_ns, verdict.hang);
  const int64_t owed_ns = sight.owed_ns + std::max<int64_t>(0, -sight.cpu_left_ns);
  const int64_t allowed_ns = std::max(sight.stolen_ns, rules.low ? rules.budget_ns / 2 : rules.deadline_ns);
  const bool used_up = owed_ns > allowed_ns && sight.cpu_left_ns < 0;
  verdict.drop = sight.running && sight.lifted && !sight.ordinary && used_up;
  verdict.lift = rules.lift && sight.running && !sight.first && sight.now_ns >= missed_ns && owed_ns > 0 &&
                 owed_ns <= sight.stolen_ns;
  return verdict;
}

WatchVerdict judge(const WatchRules& rules, const WatchSight& sight) {
  WatchVerdict verdict = judge_clock(rules, sight);
  const WatchVerdict budget = judge_budget(rules, sight);
  verdict.overrun = budget.overrun;
  verdict.look_again_ns = std::min(verdict.look_again_ns, budget.look_again_ns);
  return verdict;
}

ReserveVerdict judge_reserve(const ReserveSight& sight) {
  if (sight.lifted) return {false, false, sight.now_ns + kReserveRest_ns};
  const int64_t soonest_ns = sight.release_ns + sight.runtime_ns;
  if (sight.now_ns < soonest_ns) return {false, false, soonest_ns};
  if (sight.stood_ns > 4 * sight.period_ns + kForgotten_ns) return {false, true, sight.now_ns + kReserveRest_ns};
  const bool in_time = sight.now_ns <= sight.release_ns + sight.deadline_ns;
  if (sight.low && !in_time) return {false, false, sight.now_ns + kReserveRest_ns};
  // One that owes too much waits for its next replenishment: nothing is to be seen soon there either.
  if (sight.used_up() && sight.stands)
    return {sight.owed_ns - sight.left_ns <= sight.deadline_ns, false, sight.now_ns + kReserveRest_ns};
  return {false, false, sight.now_ns + std::max(sight.left_ns, kReserveGrain_ns)};
}

}  // namespace takt
