// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "graph/command/run_command.hpp"
#include "graph/command/run_record.hpp"
#include "graph/faults/injection.hpp"
#include "graph/faults/verdict.hpp"
#include "rt/sched/executor.hpp"

namespace takt::command {

/// The scenario of a run, if one was asked for (`--faults`); else every call does nothing.
class RunFaults {
 public:
  explicit RunFaults(const RunOptions& options) : options_(options) {}
  bool wanted() const { return !options_.faults.empty(); }
  /// Before anything is opened. What is wrong is on stderr and the exit code returned.
  int load(const graph::GraphSpec& graph, const Clock& clock);
  /// Once the plan is composed, before it is admitted.
  void make_room(Plan& plan) const;

  /// Before the executor is made: faults of jobs, of messages (the transport to be used), of the record's disk.
  std::unique_ptr<Transport> inject(std::unique_ptr<Transport> transport, Plan& plan, const Clock& clock,
                                    RunBoard& board, RunRecord& record);
  /// Virtual time: how long jobs are taken to need.
  std::function<int64_t(size_t, uint64_t)> durations(std::function<int64_t(size_t, uint64_t)> inner,
                                                     const Plan& plan) const;
  /// While it lives: loads, and somebody who looks after the nodes. Goes before plan, clock and board do.
  class Active {
   public:
    Active(RunFaults& faults, const Plan& plan, const Clock& clock, RunBoard& board);
    ~Active();
    Active(const Active&) = delete;
    Active& operator=(const Active&) = delete;

   private:
    RunFaults& faults_;
  };
  /// Virtual time: looks after the nodes, after every job.
  void look();

  /// Judges the run and adds "scenario" to the report; `exit` is that of the run, had it no scenario.
  void judge(const RunResult& result, const RunBoard& board, int exit, nlohmann::ordered_json& report) const;
  /// The exit code of the run: `told`, unless a scenario decides it.
  int exit_code(int told, const nlohmann::ordered_json& report) const;

 private:
  void begin(const Plan& plan, const Clock& clock, RunBoard& board);
  void end();

  const RunOptions& options_;
  std::unique_ptr<graph::Injection> injection_;
  std::optional<graph::HealthWatch> health_;
  const Clock* clock_ = nullptr;
  RunBoard* board_ = nullptr;
  std::jthread looking_;
};

}  // namespace takt::command
