// SPDX-License-Identifier: Apache-2.0
// A recorded run once more in virtual time, on another plan: stand-ins take the place of its nodes.
//
//   const RecordedRun recorded = read_recorded_run(log, plan);
//   RunBoard board(plan);
//   const Prediction predicted = predict(plan, recorded, {.speed = 0.5}, board);
//   board.task(t).deadline_misses, predicted.run.released[t]
#pragma once
#include <functional>
#include <vector>

#include "graph/what_if/recorded_run.hpp"
#include "rt/sched/executor.hpp"

namespace takt::what_if {

struct PredictOptions {
  double speed = 1;                    ///< how many times as fast as the recorded computer; > 0
  std::function<bool()> stopped = {};  ///< asked before each job: true ends the prediction early. May be empty
};

struct Prediction {
  RunResult run;
  /// By task: jobs for which the record has no job within half a period. They take the time of the nearest one.
  std::vector<uint64_t> borrowed;
};

/// Plays the recorded jobs under policy, cores, rates, offsets and deadlines of `plan`, whose tasks and ports are those
/// of the record in the same order; its nodes are looked at and never run. Fills the board. Throws std::runtime_error
/// if there is no memory.
Prediction predict(const Plan& plan, const RecordedRun& recorded, const PredictOptions& options, RunBoard& board);

}  // namespace takt::what_if
