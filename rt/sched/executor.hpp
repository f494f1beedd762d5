// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <atomic>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "rt/sched/grant.hpp"
#include "rt/sched/lane.hpp"
#include "rt/sched/run_board.hpp"
#include "rt/sched/watchdog.hpp"
#include "rt/trace/rings.hpp"
#include "rt/trace/trace.hpp"

namespace takt {

/// The outcome of a run, for the report.
struct RunResult {
  int64_t epoch_ns = 0, end_ns = 0;             ///< planned releases lie in [epoch, end)
  Policy policy_granted = Policy::cooperative;  ///< so too in virtual time, which asks the kernel for nothing
  std::vector<uint64_t> released;               ///< per task, see released_jobs()
  std::vector<size_t> stuck = {};               ///< tasks with a job that never returned, see Executor::run
  std::vector<std::string> refused;             ///< what the kernel refused, with the fix; not where a gate decides
  /// 0 if it was stopped before it began.
  double duration_s() const { return end_ns > epoch_ns ? static_cast<double>(end_ns - epoch_ns) / 1e9 : 0; }
};

/// Planned releases of every task in [epoch, end) while mode and requests let it run; of `on` tasks, their activations.
/// Computed from rate, window and modes, outside the executor.
std::vector<uint64_t> released_jobs(const Plan& plan, const RunBoard& board, int64_t epoch_ns, int64_t end_ns);

/// Planned releases in [epoch, end) at which the mode leaves the task out; 0 of `on` tasks, which count them as paused.
uint64_t left_out_jobs(const Plan& plan, const RunBoard& board, size_t task, int64_t epoch_ns, int64_t end_ns);

/// One line per reason for which the policy was refused, whichever lanes it hit.
std::vector<std::string> refusals(const Plan& plan, const RunBoard& board);

/// Where the processes of one run agree before they start. A run in one process needs none.
class StartGate {
 public:
  virtual ~StartGate() = default;
  /// Says whether this process got its policy and waits for the others; true if all of them did.
  virtual bool all_granted(bool mine) = 0;
  /// Waits for the instant at which all of them start.
  virtual int64_t epoch_ns() = 0;
};

/// Runs a plan, or the part of it that this process owns: makes the tasks with their edges, groups them into lanes,
/// keeps the releases. The nodes it runs are set up already and outlive the executor.
class Executor {
 public:
  struct Options {
    int64_t duration_ns = 0;              ///< 0: until stop() or the end of the data
    int64_t start_delay_ns = 50'000'000;  ///< from run() to the epoch
    bool require_policy = false;          ///< a refused policy ends the run instead of falling back to cooperative
    RunBoard* board = nullptr;            ///< shared with other processes; null: one of its own
    StartGate* gate = nullptr;            ///< where other processes are waited for
    std::vector<bool> own = {};           ///< by task: this process runs it; empty: all
    bool rejoin = false;                  ///< a process before this one ran the same tasks, and died
    bool gives_up_rights = false;         ///< the thread that calls run() needs none once all are at work
    LifeSigns* life = nullptr;            ///< of a process that somebody looks after, see Watchdog::Options
    /// A job that has not returned this long after its deadline hangs. 0: as Watchdog::patience_ns() says.
    int64_t hang_patience_ns = 0;
    std::function<int64_t()> stolen_ns = {};  ///< see StolenTime; empty: no job is lifted
    // Virtual time: see VirtualRun::Options.
    std::function<int64_t(size_t task, uint64_t job)> job_duration_ns = {};
    std::function<void()> after_step = {};
    std::function<void(const trace::Slice&)> ran = {};
    trace::Rings* trace = nullptr;  ///< where the threads that run jobs note events; null: nowhere
  };

  Executor(const Plan& plan, Transport& transport, Clock& clock, const Options& options);
  ~Executor();

  /// Runs to the end, on threads of its own (real clock) or on this one (virtual clock). Once per executor. Throws
  /// PolicyRefused if require_policy and the kernel refuses. A job that never returns does not keep it from returning:
  /// then RunResult::stuck names the task, its thread goes on, and what it uses (node, transport, executor) must live
  /// until the process ends.
  RunResult run();
  /// Ends the run cleanly: no release after this instant. Any thread, also a signal handler.
  void stop() { stop_.raise(clock_.now_ns()); }
  /// By index into the plan's tasks; null where another process runs it.
  const std::vector<std::unique_ptr<Task>>& tasks() const { return tasks_; }
  const Plan& plan() const { return plan_; }
  const RunBoard& board() const { return board_; }

 private:
  /// False if the kernel refused the policy to a lane, here or in another process.
  bool run_partitioned(Policy policy, RunResult& result);
  /// While the workers wait, with what they were granted: lets them go if everybody got the policy.
  void agree(Policy policy, RunResult& result);
  void watch(Policy granted);
  /// Waits for all workers but those whose job never returns: that was late and used more than it may.
  void join(RunResult& result);
  std::vector<Reservation> own_reservations(Policy policy) const;
  void set_grants(const Lane& lane, const Grant& grant);
  void start_clockwork(RunResult& result);
  void run_cooperative(RunResult& result);
  void run_virtual(RunResult& result);

  const Plan plan_;
  Transport& transport_;
  Clock& clock_;
  const Options options_;
  std::unique_ptr<RunBoard> own_board_;
  RunBoard& board_;
  StopSignal& stop_;
  std::vector<std::unique_ptr<Task>> tasks_;
  std::vector<std::unique_ptr<Lane>> lanes_;
  struct Crew;
  std::unique_ptr<Crew> crew_;  ///< threads and what they share
};

struct PolicyRefused : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace takt
