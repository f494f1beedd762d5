// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>

#include "graph/run/record.hpp"
#include "graph/run/run.hpp"
#include "rt/sched/executor.hpp"
#include "rt/trace/collector.hpp"

namespace takt::command {

/// What the jobs of a run note, if a trace (`--trace`) or a record was asked for; else every call does nothing.
class RunTrace {
 public:
  /// Before the processes of the run are made: they share what is made here. Only the shape of the plan is used.
  RunTrace(const RunOptions& options, const Plan& plan, size_t processes);
  /// Where threads note events; null: nowhere.
  trace::Rings* rings() const { return rings_.get(); }
  /// Begins to collect, in the process that lasts longest, and tells every event to the record.
  void collect(const Plan& plan, RunRecord& record);
  /// Virtual time: each stretch in which a lane had a core.
  void ran(const trace::Slice& slice) {
    if (collector_ && !options_.trace.empty()) collector_->add(slice);
  }
  /// Virtual time: after every half of a job.
  void drain() {
    if (collector_) collector_->drain();
  }
  /// Ends collecting and writes the trace, if one was asked for; see RunOutputs::write().
  void write(const graph::GraphSpec& graph, const Plan& plan, const RunBoard& board, const RunResult& result);
  /// Threads that found no room for their events.
  size_t unheard_threads() const { return rings_ ? rings_->refused() : 0; }

 private:
  const RunOptions& options_;
  std::unique_ptr<trace::Rings> rings_;
  std::unique_ptr<trace::Collector> collector_;
};

}  // namespace takt::command
