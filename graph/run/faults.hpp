// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>
#include <optional>

#include "graph/faults/injection.hpp"
#include "graph/faults/verdict.hpp"
#include "graph/run/periodic.hpp"
#include "graph/run/record.hpp"
#include "graph/run/run.hpp"
#include "hal/settings/json.hpp"
#include "rt/sched/executor.hpp"

namespace takt::command {

/// The scenario of a run, if one was asked for (`--faults`); else every call does nothing.
class RunFaults {
 public:
  RunFaults(const Registry& registry, const RunOptions& options) : registry_(registry), options_(options) {}
  bool wanted() const { return !options_.faults.empty(); }
  /// Before anything is opened and before there are other processes: devices that are to fail are told so in the graph.
  /// What is wrong is on stderr and the exit code returned. `processes`: one per subsystem.
  int load(graph::GraphSpec& graph, const Clock& clock, bool processes);
  /// In every process: once the plan is composed, before the pools are made.
  void make_room(Plan& plan) const;
  /// In every process, before the executor is made: faults of jobs and of messages; the transport to be used.
  std::unique_ptr<Transport> inject(std::unique_ptr<Transport> transport, Plan& plan, const Clock& clock,
                                    RunBoard& board);
  /// Of the record's disk. Before it begins.
  void disturb_disk(RunRecord& record, const Clock& clock, RunBoard& board);
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
  /// Processes to be struck now, each told once; those of the past are passed over at the first call.
  std::vector<graph::ProcessStrike> due(int64_t now_ns);
  void count(const graph::ProcessStrike& strike) { injection_->count_strike(strike.fault); }

  /// Judges the run and adds "scenario" to the report; `exit` is that of the run, had it no scenario. `processes`:
  /// names of those that the board's outages number.
  void judge(const RunResult& result, const RunBoard& board, int exit, const std::vector<std::string>& processes,
             nlohmann::ordered_json& report) const;
  /// The exit code of the run: `told`, unless a scenario decides it.
  int exit_code(int told, const nlohmann::ordered_json& report) const;

 private:
  void begin(const Plan& plan, const Clock& clock, RunBoard& board);
  void end();

  const Registry& registry_;
  const RunOptions& options_;
  std::unique_ptr<graph::Injection> injection_;
  std::optional<graph::HealthWatch> health_;
  const Clock* clock_ = nullptr;
  RunBoard* board_ = nullptr;
  const Plan* plan_ = nullptr;
  bool asked_ = false;  ///< due() has been called
  std::optional<Periodic> looking_;
};

}  // namespace takt::command
