// SPDX-License-Identifier: Apache-2.0
// A schedule played through event by event, in whole ticks: what happens, where the analyses say what can. The slow
// reference of their tests. No clock, no thread, no input or output; the same calls give the same schedule.
#pragma once
#include <functional>
#include <limits>
#include <optional>
#include <vector>

#include "rt/sched/analysis/task_set.hpp"

namespace takt::analysis {

/// Who runs. The first three are preemptive; all but global_edf serve each core by itself (TimedTask::core).
enum class Dispatch : uint8_t {
  fixed_priority,
  edf,
  global_edf,  ///< the TaskSet::cores earliest deadlines run, each on any core
  non_preemptive_edf
};

inline constexpr Ticks kNotYet = std::numeric_limits<Ticks>::min();

struct SimulatedJob {
  size_t task = 0;
  int64_t number = 0;  ///< 0, 1, ... per task, in the order of being added
  Ticks planned = 0;
  Ticks ready = 0;
  Ticks deadline = 0;  ///< absolute
  Ticks duration = 0;  ///< known from its start on
  Ticks start = kNotYet;
  Ticks finish = kNotYet;
  int preemptions = 0;  ///< how often it lost its core before it was finished
  int core = -1;        ///< where it ran last

  Ticks response() const { return finish - planned; }
  bool late() const { return finish > deadline; }
};

struct SimulationHooks {
  /// Execution time of a job, asked once, when it starts; >= 0. Empty: its budget.
  std::function<Ticks(const SimulatedJob&)> duration = {};
  /// Called when a job has finished, before anything else happens at that instant; may add jobs.
  std::function<void(const SimulatedJob&)> finished = {};
  /// Called when a job leaves its core, with the stretch that it had it: preempted, or finished (then before
  /// `finished`).
  std::function<void(const SimulatedJob&, Ticks from, Ticks to)> ran = {};
};

/// The schedule of a task set. Jobs of one task run one after another, in the order of getting ready (then of being
/// added).
///
/// Order of events. At one instant, first the jobs that are done finish (in the order of cores), then jobs become ready
/// (in the order of tasks), then each core takes the first of its pending jobs: by priority, or absolute deadline; ties
/// by the larger TimedTask::priority, then the earlier task. A job that is first keeps the core it ran on last if that
/// is free, else the lowest free one, in that order of jobs. Only durations of 0 make an instant come up again.
class Simulator {
 public:
  /// A set without `defect`; a core of -1 counts as core 0.
  Simulator(TaskSet set, Dispatch dispatch, SimulationHooks hooks = {});

  /// Jobs of this task, once started, are not preempted (always so under non_preemptive_edf).
  void make_non_preemptable(size_t task) { preemptable_[task] = false; }
  /// A job due at planned + deadline, ready at `ready` >= now.
  void add(size_t task, Ticks planned, Ticks ready);
  /// To be called by the hook `finished` of a job that is not preempted: its core goes on at once with another one of
  /// its task, before any other.
  void add_next_part(const SimulatedJob& finished, Ticks planned);
  /// Plays all events up to and including `end`.
  void run_until(Ticks end);
  /// Until no job is left; ends only if the hook adds no jobs for ever.
  void run() { run_until(std::numeric_limits<Ticks>::max()); }

  /// Of the last event; kNotYet before the first.
  Ticks now() const { return now_; }
  /// In the order of being added.
  const std::vector<SimulatedJob>& jobs() const { return jobs_; }

 private:
  struct Core {
    std::optional<size_t> job = {};
    Ticks since = 0;  ///< start or resumption of it
  };
  /// Tasks that share processors: those of one core, or all.
  struct Group {
    std::vector<size_t> tasks = {};
    size_t first_core = 0;
    size_t end_core = 0;
  };

  Ticks next_event() const;
  void finish_jobs();
  void admit_ready_jobs();
  void dispatch(const Group& group);
  void choose(const Group& group);
  void stop(Core& core);
  void place(size_t job, const Group& group);
  bool ready_later(size_t job, size_t other) const;
  bool running(size_t job) const;
  bool goes_before(size_t job, size_t other) const;

  TaskSet set_;
  Dispatch dispatch_;
  SimulationHooks hooks_;
  Ticks now_ = kNotYet;
  std::vector<Group> groups_ = {};
  std::vector<bool> preemptable_;
  std::vector<SimulatedJob> jobs_ = {};
  std::vector<Ticks> left_ = {};              ///< execution time left when last looked at, per job
  std::vector<bool> keeps_core_ = {};         ///< per job: of the one before it, until it runs
  std::vector<size_t> arrivals_ = {};         ///< heap of the jobs that are not ready yet
  std::vector<std::vector<size_t>> pending_;  ///< per task: ready and unfinished, oldest first
  std::vector<int64_t> added_;                ///< jobs per task
  std::vector<Core> cores_;
  std::vector<size_t> chosen_ = {};  ///< scratch of dispatch
};

struct Arrival {
  Ticks planned = 0;
  Ticks ready = 0;
};

/// Plays the arrivals through until the last job has finished; arrivals[i] are those of task i.
std::vector<SimulatedJob> simulate(const TaskSet& set, Dispatch dispatch,
                                   const std::vector<std::vector<Arrival>>& arrivals, SimulationHooks hooks = {});

/// What a task does by itself: releases at offset + k * period before `end`, ready at once.
std::vector<Arrival> periodic_arrivals(const TimedTask& task, Ticks end);

}  // namespace takt::analysis
