// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <atomic>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "rt/sched/grant.hpp"
#include "rt/sched/lane.hpp"
#include "rt/sched/stop_signal.hpp"

namespace takt {

/// The outcome of a run, for the report.
struct RunResult {
  int64_t epoch_ns = 0, end_ns = 0;  ///< planned releases lie in [epoch, end)
  Policy policy_granted = Policy::cooperative;  ///< also in virtual time, which asks the kernel for nothing
  std::vector<Grant> grants;         ///< per task
  std::vector<uint64_t> released;    ///< per task; computed from rate and window for those with a rate
  std::vector<std::string> refused;  ///< what the kernel refused, with the fix
  /// 0 if it was stopped before it began.
  double duration_s() const { return end_ns > epoch_ns ? static_cast<double>(end_ns - epoch_ns) / 1e9 : 0; }
};

/// Runs a plan: makes the tasks with their edges, groups them into lanes, keeps the releases. The nodes of the plan are
/// set up already and outlive the executor.
class Executor {
 public:
  struct Options {
    int64_t duration_ns = 0;              ///< 0: until stop() or the end of the data
    int64_t start_delay_ns = 50'000'000;  ///< from run() to the epoch
    bool require_policy = false;          ///< a refused policy ends the run instead of falling back to cooperative
  };

  Executor(const Plan& plan, Transport& transport, Clock& clock, const Options& options);
  ~Executor();

  /// Runs to the end, on threads of its own (real clock) or on this one (virtual clock). Once per executor. Throws
  /// PolicyRefused if require_policy and the kernel refuses.
  RunResult run();
  /// Ends the run cleanly: no release after this instant. Any thread, also a signal handler.
  void stop() { stop_.raise(clock_.now_ns()); }
  const std::vector<std::unique_ptr<Task>>& tasks() const { return tasks_; }
  const Plan& plan() const { return plan_; }

 private:
  bool run_partitioned(Policy policy, RunResult& result);
  std::vector<Reservation> reservations(Policy policy) const;
  void start_clockwork(RunResult& result);
  void run_cooperative();
  void run_virtual(RunResult& result);
  void count_released(RunResult& result) const;

  const Plan plan_;
  Clock& clock_;
  const Options options_;
  std::vector<std::unique_ptr<Task>> tasks_;
  std::vector<std::unique_ptr<Lane>> lanes_;
  StopSignal stop_;
};

struct PolicyRefused : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace takt
