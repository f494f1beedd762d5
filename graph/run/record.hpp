// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "graph/run/run.hpp"
#include "hal/settings/json.hpp"
#include "rt/record/mcap/file_sink.hpp"
#include "rt/record/recorder.hpp"
#include "rt/sched/executor.hpp"
#include "rt/sched/plan_ports.hpp"

namespace takt::command {

/// Who reads the outputs of a run beside its edges: `takt echo`; the recorder, and what follows the conditions of the
/// graph, if there are any.
Observers observers(const RunOptions& options, const graph::GraphSpec& graph);

/// The record of a run, if one was asked for (`--record`); else every call does nothing.
class RunRecord {
 public:
  /// Throws std::invalid_argument if --record-port names an output that the plan does not have.
  RunRecord(const Registry& registry, const RunOptions& options, const Plan& plan);
  bool wanted() const { return !options_.record.empty(); }
  /// Before the first job, once the ports have their memory. Throws std::runtime_error if the file cannot be made.
  void begin(const graph::GraphSpec& graph, const Plan& plan, const RunBoard& board, Transport& transport,
             const std::string& isolation);
  /// What stands between recorder and file, made once that is open; null: nothing. Before begin().
  using Disk = std::function<std::unique_ptr<mcap::Sink>(mcap::Sink& file)>;
  void on_disk(Disk disk) { make_disk_ = std::move(disk); }
  void take(int32_t ring, const trace::Event& event) {
    if (recorder_) recorder_->take(ring, event);
  }
  /// Virtual time: after every job.
  void capture() {
    if (recorder_) recorder_->capture();
  }
  /// After the last job, before those who published leave.
  void take_rest() {
    if (recorder_) recorder_->take_rest();
  }
  /// After the last event was taken; `unheard_threads` noted none.
  void finish(const RunResult& result, uint64_t unheard_threads);
  /// Adds "record" and "recorder_lost" to the report.
  void tell(nlohmann::ordered_json& report) const;

 private:
  const Registry& registry_;
  const RunOptions& options_;
  std::optional<mcap::FileSink> file_;
  Disk make_disk_;
  std::unique_ptr<mcap::Sink> disk_;
  std::unique_ptr<record::Recorder> recorder_;
  record::RecordResult written_;
};

}  // namespace takt::command
