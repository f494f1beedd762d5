// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/analysis/simulate.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

namespace takt::analysis {
namespace {

constexpr Ticks kLatest = std::numeric_limits<Ticks>::max();

}  // namespace

Simulator::Simulator(TaskSet set, Dispatch dispatch, SimulationHooks hooks)
    : set_(std::move(set)),
      dispatch_(dispatch),
      hooks_(std::move(hooks)),
      preemptable_(set_.tasks.size(), dispatch != Dispatch::non_preemptive_edf),
      pending_(set_.tasks.size()),
      added_(set_.tasks.size(), 0),
      cores_(static_cast<size_t>(set_.cores)) {
  if (dispatch_ == Dispatch::global_edf) {
    groups_.push_back({{}, 0, cores_.size()});
  } else {
    for (size_t core = 0; core < cores_.size(); ++core) groups_.push_back({{}, core, core + 1});
  }
  for (size_t task = 0; task < set_.tasks.size(); ++task) {
    const int core = dispatch_ == Dispatch::global_edf ? 0 : std::max(set_.tasks[task].core, 0);
    groups_[static_cast<size_t>(core)].tasks.push_back(task);
  }
}

void Simulator::add(size_t task, Ticks planned, Ticks ready) {
  SimulatedJob job;
  job.task = task;
  job.number = added_[task]++;
  job.planned = planned;
  job.ready = ready;
  job.deadline = planned + set_.tasks[task].deadline;
  jobs_.push_back(job);
  left_.push_back(0);
  keeps_core_.push_back(false);
  arrivals_.push_back(jobs_.size() - 1);
  std::push_heap(arrivals_.begin(), arrivals_.end(), [&](size_t a, size_t b) { return ready_later(a, b); });
}

void Simulator::add_next_part(const SimulatedJob& finished, Ticks planned) {
  add(finished.task, planned, now_);
  jobs_.back().core = finished.core;
  keeps_core_.back() = true;
}

void Simulator::run_until(Ticks end) {
  for (Ticks next = next_event(); next != kLatest && next <= end; next = next_event()) {
    now_ = next;
    finish_jobs();
    admit_ready_jobs();
    for (const Group& group : groups_) dispatch(group);
  }
}

Ticks Simulator::next_event() const {
  Ticks next = kLatest;
  if (!arrivals_.empty()) next = jobs_[arrivals_.front()].ready;
  for (const Core& core : cores_) {
    if (core.job) next = std::min(next, core.since + left_[*core.job]);
  }
  return next;
}

void Simulator::finish_jobs() {
  for (Core& core : cores_) {
    if (!core.job || core.since + left_[*core.job] > now_) continue;
    const size_t done = *core.job;
    core.job.reset();
    left_[done] = 0;
    jobs_[done].finish = now_;
    if (hooks_.ran) hooks_.ran(jobs_[done], core.since, now_);
    std::vector<size_t>& queue = pending_[jobs_[done].task];
    queue.erase(std::find(queue.begin(), queue.end(), done));
    if (hooks_.finished) hooks_.finished(SimulatedJob(jobs_[done]));  // a copy: the hook may add jobs
  }
}

void Simulator::admit_ready_jobs() {
  while (!arrivals_.empty() && jobs_[arrivals_.front()].ready <= now_) {
    const size_t job = arrivals_.front();
    std::pop_heap(arrivals_.begin(), arrivals_.end(), [&](size_t a, size_t b) { return ready_later(a, b); });
    arrivals_.pop_back();
    pending_[jobs_[job].task].push_back(job);
  }
}

void Simulator::dispatch(const Group& group) {
  choose(group);
  for (size_t core = group.first_core; core < group.end_core; ++core) {
    const auto& running = cores_[core].job;
    if (running && std::find(chosen_.begin(), chosen_.end(), *running) == chosen_.end()) stop(cores_[core]);
  }
  for (const size_t job : chosen_) {
    if (!running(job)) place(job, group);
  }
}

/// The jobs that have a core from now on, first ones first: of each task its oldest.
void Simulator::choose(const Group& group) {
  chosen_.clear();
  for (const size_t task : group.tasks) {
    if (!pending_[task].empty()) chosen_.push_back(pending_[task].front());
  }
  const size_t most = group.end_core - group.first_core;
  const size_t count = std::min(most, chosen_.size());
  std::partial_sort(chosen_.begin(), chosen_.begin() + static_cast<std::ptrdiff_t>(count), chosen_.end(),
                    [&](size_t a, size_t b) { return goes_before(a, b); });
  chosen_.resize(count);
}

void Simulator::stop(Core& core) {
  left_[*core.job] -= now_ - core.since;
  ++jobs_[*core.job].preemptions;
  if (hooks_.ran) hooks_.ran(jobs_[*core.job], core.since, now_);
  core.job.reset();
}

void Simulator::place(size_t index, const Group& group) {
  SimulatedJob& job = jobs_[index];
  size_t core = group.first_core;
  if (job.core >= 0 && !cores_[static_cast<size_t>(job.core)].job) {
    core = static_cast<size_t>(job.core);
  } else {
    while (cores_[core].job) ++core;
  }
  if (job.start == kNotYet) {
    job.start = now_;
    job.core = static_cast<int>(core);
    job.duration = hooks_.duration ? hooks_.duration(job) : set_.tasks[job.task].budget;
    left_[index] = job.duration;
  }
  job.core = static_cast<int>(core);
  keeps_core_[index] = false;
  cores_[core].job = index;
  cores_[core].since = now_;
}

bool Simulator::ready_later(size_t a, size_t b) const {
  return std::tie(jobs_[a].ready, jobs_[a].task, a) > std::tie(jobs_[b].ready, jobs_[b].task, b);
}

bool Simulator::running(size_t job) const {
  const int core = jobs_[job].core;
  return core >= 0 && cores_[static_cast<size_t>(core)].job == job;
}

bool Simulator::goes_before(size_t a, size_t b) const {
  const SimulatedJob &one = jobs_[a], &other = jobs_[b];
  const TimedTask &task = set_.tasks[one.task], &other_task = set_.tasks[other.task];
  const bool pinned = keeps_core_[a] || (!preemptable_[one.task] && running(a));
  const bool other_pinned = keeps_core_[b] || (!preemptable_[other.task] && running(b));
  if (pinned != other_pinned) return pinned;
  if (dispatch_ != Dispatch::fixed_priority && one.deadline != other.deadline) return one.deadline < other.deadline;
  if (task.priority != other_task.priority) return task.priority > other_task.priority;
  return one.task < other.task;
}

std::vector<SimulatedJob> simulate(const TaskSet& set, Dispatch dispatch,
                                   const std::vector<std::vector<Arrival>>& arrivals, SimulationHooks hooks) {
  Simulator simulator(set, dispatch, std::move(hooks));
  for (size_t task = 0; task < arrivals.size(); ++task) {
    for (const Arrival& arrival : arrivals[task]) simulator.add(task, arrival.planned, arrival.ready);
  }
  simulator.run();
  return simulator.jobs();
}

std::vector<Arrival> periodic_arrivals(const TimedTask& task, Ticks end) {
  std::vector<Arrival> arrivals;
  for (Ticks planned = task.offset; planned < end; planned += task.period) arrivals.push_back({planned, planned});
  return arrivals;
}

}  // namespace takt::analysis
