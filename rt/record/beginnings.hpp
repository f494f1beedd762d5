// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <vector>

#include "rt/record/log_file.hpp"
#include "rt/sched/plan.hpp"

namespace takt::record {

/// Where the jobs of a task begin to be run again.
struct Beginning {
  const RecordedEvent* snapshot = nullptr;  ///< what it goes on from; null: its first job of the record begins
  bool in_the_middle = false;               ///< and that is not the first one of the run
  int64_t at_ns() const { return snapshot != nullptr ? snapshot->at_ns : INT64_MIN; }
  uint32_t job() const { return snapshot != nullptr ? snapshot->job : 0; }
};

/// By task, so that all runs from `from_ns` on: each at its last snapshot before that. A task whose messages others
/// need from there on, and of which the record has hashes only, begins as much earlier as it takes. `runs`, by task:
/// those that matter. Events are those of the log, which outlives the answer.
std::vector<Beginning> beginnings(const Plan& plan, const LogFile& log, const std::vector<char>& runs, int64_t from_ns);

}  // namespace takt::record
