// SPDX-License-Identifier: Apache-2.0
// Everything that can happen to a tiny task set on one core, tick by tick: every arrival of sporadic tasks, every delay
// up to the jitter, every choice between equal deadlines. A search over all reachable states, so that its answers owe
// nothing to any theory of worst cases. Execution times are the budgets. Ends at the first miss.
#pragma once
#include <numeric>
#include <unordered_set>
#include <vector>

#include "rt/sched/analysis/simulate.hpp"

namespace takt::analysis {

class Adversary {
 public:
  /// Periods below 32, at most 3 tasks, blocking below 16. `dispatch` any but global.
  Adversary(const std::vector<TimedTask>& tasks, Dispatch dispatch, size_t held = 4)
      : tasks_(tasks), dispatch_(dispatch), held_(held) {
    for (const TimedTask& task : tasks_) {
      if (task.sporadic) continue;
      common_ = std::lcm(common_, task.period);
      steady_ = std::max(steady_, task.offset);
    }
    longest.assign(tasks_.size(), 0);
    State first;
    for (size_t i = 0; i < tasks_.size(); ++i) first.jobs[i].since = tasks_[i].period;
    open_.push_back(first);
    while (!open_.empty() && !late) {
      const State state = open_.back();
      open_.pop_back();
      arrive(state, 0);
      hold(state);
    }
  }

  bool late = false;           ///< a job missed that counts
  bool disturbed = false;      ///< one missed that does not see the blocking; what follows that was not searched
  std::vector<Ticks> longest;  ///< response per task, as long as nothing is late
  size_t states() const { return seen_.size(); }

 private:
  struct JobState {
    Ticks since = 0;  ///< since the last planned release, at most a period
    Ticks left = 0;   ///< 0: nothing pending
    bool ready = false;
  };
  struct State {
    Ticks time = 0;
    JobState jobs[3] = {};
    size_t running = 4;      ///< a started job that is not preempted
    Ticks held = 0;          ///< the core is held so much longer
    bool has_held = false;   ///< ... or has been
    Ticks counts_until = 0;  ///< once it has been: the deadline picked, from now
  };

  /// The held task's blocking begins, for every deadline ahead of which nothing is pending.
  void hold(const State& state) {
    if (held_ >= tasks_.size() || state.has_held || tasks_[held_].blocking == 0) return;
    const bool priorities = dispatch_ == Dispatch::fixed_priority;
    for (Ticks until = 1; until <= (priorities ? 1 : 48); ++until) {
      bool idle = true;
      for (size_t i = 0; i < tasks_.size(); ++i) {
        const JobState& job = state.jobs[i];
        const bool ahead =
            priorities ? tasks_[i].priority >= tasks_[held_].priority : tasks_[i].deadline - job.since <= until;
        idle = idle && !(job.left > 0 && job.ready && ahead);
      }
      if (!idle) continue;
      State next = state;
      next.held = tasks_[held_].blocking;
      next.has_held = true;
      next.counts_until = until;
      arrive(next, 0);
    }
  }

  bool counts(const State& state, size_t task) const {
    if (!state.has_held) return true;
    if (task != held_) return false;
    return dispatch_ == Dispatch::fixed_priority ||
           tasks_[task].deadline - state.jobs[task].since <= state.counts_until;
  }

  /// What each task from `i` on may do at this instant: release or not, get ready or not.
  void arrive(const State& state, size_t i) {
    if (i == tasks_.size()) return dispatch(state);
    const TimedTask& task = tasks_[i];
    const JobState& job = state.jobs[i];
    const bool due = state.time >= task.offset && (state.time - task.offset) % task.period == 0;
    const bool may = job.left == 0 && (task.sporadic ? job.since >= task.period : due);
    if (may) {
      State next = state;
      next.jobs[i] = {0, task.budget, false};
      get_ready(next, i);
    }
    if (!may || task.sporadic) get_ready(state, i);
  }

  void get_ready(const State& state, size_t i) {
    const JobState& job = state.jobs[i];
    if (job.left == 0 || job.ready) return arrive(state, i + 1);
    State next = state;
    next.jobs[i].ready = true;
    arrive(next, i + 1);
    if (job.since < tasks_[i].jitter) arrive(state, i + 1);
  }

  bool goes_before(const State& state, size_t a, size_t b) const {
    if (dispatch_ == Dispatch::fixed_priority) return tasks_[a].priority > tasks_[b].priority;
    return tasks_[a].deadline - state.jobs[a].since < tasks_[b].deadline - state.jobs[b].since;
  }

  void dispatch(const State& state) {
    if (state.held > 0) {
      State next = state;
      --next.held;
      return advance(next);
    }
    if (state.running < 4) return run(state, state.running);
    bool idle = true;
    for (size_t i = 0; i < tasks_.size(); ++i) {
      const auto ready = [&](size_t k) { return state.jobs[k].left > 0 && state.jobs[k].ready; };
      if (!ready(i)) continue;
      idle = false;
      bool first = true;
      for (size_t k = 0; k < tasks_.size(); ++k) first = first && !(ready(k) && goes_before(state, k, i));
      if (first) run(state, i);
    }
    if (idle) advance(state);
  }

  void run(State state, size_t chosen) {
    JobState& job = state.jobs[chosen];
    if (--job.left > 0) {  // its execution time may be longer than so far
      State longer = state;
      if (dispatch_ == Dispatch::non_preemptive_edf) longer.running = chosen;
      advance(longer);
    }
    if (counts(state, chosen)) longest[chosen] = std::max(longest[chosen], job.since + 1);
    job = {job.since, 0, false};
    state.running = 4;
    advance(state);
  }

  void advance(State state) {
    bool was_counted[3] = {}, misses_elsewhere = false;
    for (size_t i = 0; i < tasks_.size(); ++i) was_counted[i] = counts(state, i);
    for (size_t i = 0; i < tasks_.size(); ++i) {
      JobState& job = state.jobs[i];
      job.since = std::min(job.since + 1, tasks_[i].period);
      if (job.left > 0 && job.since >= tasks_[i].deadline) (was_counted[i] ? late : misses_elsewhere) = true;
      if (job.left == 0 && !tasks_[i].sporadic) job.since = 0;  // its phase is the time's
    }
    disturbed = disturbed || misses_elsewhere;
    if (misses_elsewhere) return;
    if (dispatch_ != Dispatch::fixed_priority && state.counts_until > 0 && --state.counts_until == 0) return;
    ++state.time;
    if (state.time >= steady_ + common_) state.time -= common_;
    if (!late && seen_.insert(key(state)).second) open_.push_back(state);
  }

  uint64_t key(const State& state) const {
    uint64_t key = static_cast<uint64_t>(state.time) * 8 + state.running;
    key = (key * 16 + static_cast<uint64_t>(state.held)) * 64 + static_cast<uint64_t>(state.counts_until);
    key = key * 2 + (state.has_held ? 1 : 0);
    for (size_t i = 0; i < tasks_.size(); ++i) {
      const JobState& job = state.jobs[i];
      key = key * 2048 + static_cast<uint64_t>(job.since * 64 + job.left * 2 + (job.ready ? 1 : 0));
    }
    return key;
  }

  std::vector<TimedTask> tasks_;
  Dispatch dispatch_;
  size_t held_;
  Ticks common_ = 1, steady_ = 0;
  std::vector<State> open_;
  std::unordered_set<uint64_t> seen_;
};

}  // namespace takt::analysis
