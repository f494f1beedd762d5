// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <vector>

#include "graph/expect/expectation_watch.hpp"
#include "graph/run/periodic.hpp"
#include "graph/run/run.hpp"
#include "hal/settings/json.hpp"
#include "rt/sched/run_board.hpp"
#include "rt/time/clock.hpp"

namespace takt::command {

/// What the graph of a run expects (its part `expect`), if anything; else every call does nothing.
class RunExpectations {
 public:
  RunExpectations(const RunOptions& options, const graph::GraphSpec& graph) : options_(options), graph_(graph) {}
  bool wanted() const { return graph_.expect.has_value(); }
  /// Once the devices are made: kOk, or what cannot be looked at is on stderr and this is the exit code. `world`: of
  /// this process, without objects if it has none.
  int bind(graph::WorldTruth world);
  /// While it lives the conditions are followed, and the run is ended once they are decided. Goes before plan, board
  /// and transport do.
  class Active {
   public:
    Active(RunExpectations& expectations, const Plan& plan, const Clock& clock, RunBoard& board, Transport& transport);
    ~Active();
    Active(const Active&) = delete;
    Active& operator=(const Active&) = delete;

   private:
    RunExpectations& expectations_;
  };
  /// Virtual time: after every half of a job.
  void look();
  /// Adds "expectations" to the report.
  void judge(nlohmann::ordered_json& report) const;
  /// The exit code of the run: `told`, unless what was expected decides it.
  int exit_code(int told, const nlohmann::ordered_json& report) const;

 private:
  const RunOptions& options_;
  const graph::GraphSpec& graph_;
  graph::WorldTruth world_;
  std::optional<graph::ExpectationWatch> watch_;
  std::optional<Periodic> looking_;
  const Clock* clock_ = nullptr;
  RunBoard* board_ = nullptr;
  bool decided_ = false;                  ///< what jobs that were at work then still say does not count
  std::vector<graph::Finding> findings_;  ///< of the conditions, once the run has ended
};

}  // namespace takt::command
