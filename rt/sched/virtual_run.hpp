// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <memory>
#include <vector>

#include "rt/sched/analysis/simulate.hpp"
#include "rt/sched/lane.hpp"
#include "rt/trace/rings.hpp"
#include "rt/trace/trace.hpp"

namespace takt {

/// Whole runs in virtual time: the jobs are real, the time they take is imagined. A job latches and works at the
/// instant at which the simulated schedule (analysis::Simulator, see there for the order of events) lets it start, and
/// publishes when it is taken to be done. Policy, cores and preemption are those of the plan: `deadline` is global EDF
/// with the deadlines of the reservations, whose budgets nobody enforces; `fixed` is per core, by priority;
/// `cooperative` is global EDF in which a core stays with a lane until the pass is done, asleep where that waits for a
/// `let` output. A plan that names no cores has one for each lane: nobody waits. The same plan, nodes and durations
/// give the same run. On the calling thread alone.
class VirtualRun {
 public:
  struct Options {
    /// How long a job of that task is taken to need at full quality, ns; empty: its budget.
    std::function<int64_t(size_t task, uint64_t job)> duration_ns = {};
    /// Called after each half of a job: it has begun, or has published.
    std::function<void()> after_step = {};
    /// Called with each stretch of time in which a lane had a core, `thread` being that of its ring. May be empty.
    std::function<void(const trace::Slice&)> ran = {};
    trace::Rings* trace = nullptr;  ///< one ring for each lane, as if each had its thread
  };
  /// All lanes of the plan, in its order; their epoch is set.
  VirtualRun(const Plan& plan, const std::vector<std::unique_ptr<Lane>>& lanes, VirtualClock& clock, StopSignal& stop,
             Options options);
  /// Until no lane has a release before the end.
  void run();

 private:
  /// What one lane is at.
  struct Course {
    Lane* lane = nullptr;
    trace::Ring* ring = nullptr;
    Lane::Activation job = {};
    bool dropped = false;                        ///< the run ended before it started
    std::vector<Lane::Activation> waiting = {};  ///< followers still to run in this pass
    bool asleep = false;                         ///< its worker waits for the release of the follower `job`
  };

  analysis::Ticks begin(const analysis::SimulatedJob& job);
  void finish(const analysis::SimulatedJob& job);
  void tell_stretch(const analysis::SimulatedJob& job, int64_t from_ns, int64_t to_ns) const;
  int core_of(const analysis::SimulatedJob& job) const;
  void expect_head(size_t lane);
  void expect_follower(const analysis::SimulatedJob& before);
  void add(size_t lane, int64_t ready_ns);

  const Plan& plan_;
  VirtualClock& clock_;
  StopSignal& stop_;
  const Options options_;
  std::vector<Course> courses_;
  analysis::Simulator simulator_;
  std::vector<Lane::Activation> released_ = {};
};

}  // namespace takt
