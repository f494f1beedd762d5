// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <list>
#include <memory>
#include <optional>
#include <string>

#include "graph/flight/flight_recorder.hpp"
#include "graph/run/run.hpp"
#include "hal/settings/json.hpp"
#include "rt/record/mcap/file_sink.hpp"
#include "rt/record/recorder.hpp"
#include "rt/sched/executor.hpp"
#include "rt/sched/plan_ports.hpp"
#include "rt/time/clock.hpp"

namespace takt::command {

/// Who reads the outputs of a run beside its edges: `takt echo`; the recorder, and what follows the conditions of the
/// graph, if there are any.
Observers observers(const RunOptions& options, const graph::GraphSpec& graph);

/// Whether a run keeps a ring: as the command line says, else the graph; in virtual time only if asked to.
bool keeps_ring(const RunOptions& options, const graph::GraphSpec& graph);

/// What a run records: into a file, if one was asked for (`--record`), and into the ring, if it keeps one. Without
/// either every call does nothing.
class RunRecord {
 public:
  /// Throws std::invalid_argument if --record-port names an output that the plan does not have.
  RunRecord(const Registry& registry, const RunOptions& options, const Plan& plan);
  bool wanted() const { return !options_.record.empty(); }
  /// Somebody hears what jobs note.
  bool listens() const { return wanted() || options_.keep_ring; }
  /// Before the first job, once the ports have their memory. Throws std::runtime_error if the file cannot be made.
  void begin(const graph::GraphSpec& graph, const Plan& plan, const RunBoard& board, Transport& transport,
             const std::string& isolation, std::vector<std::string> processes = {});
  /// What stands between recorder and file, made once that is open; null: nothing. Before begin().
  using Disk = std::function<std::unique_ptr<mcap::Sink>(mcap::Sink& file)>;
  void on_disk(Disk disk) { make_disk_ = std::move(disk); }
  /// What that has for the time: a virtual run is ahead of its file, by as much as threads happen to be late.
  const Clock& disk_clock(const Clock& of_run) const { return of_run.is_virtual() ? written_at_ : of_run; }
  void take(int32_t ring, const trace::Event& event) {
    if (recorder_) recorder_->take(ring, event);
    if (flight_) flight_->take(ring, event);
  }
  /// Virtual time: after every job.
  void capture() {
    if (recorder_) recorder_->capture();
    if (flight_) flight_->capture();
  }
  /// After the last job, before those who published leave.
  void take_rest() {
    if (recorder_) recorder_->take_rest();
    if (flight_) flight_->take_rest();
  }
  /// Reads the transport no more, whatever else is still to come. Without finish() before, what was recorded has an end
  /// that says nothing.
  void let_go() { recorder_.reset(), flight_.reset(); }
  /// After the last event was taken; `unheard_threads` noted none.
  void finish(const RunResult& result, uint64_t unheard_threads);
  /// Where frozen windows are written; empty: nowhere.
  std::filesystem::path frozen_folder() const;
  /// What froze the ring so far, the newest last: a sentence each.
  std::vector<std::string> frozen() const { return flight_ ? flight_->sentences() : std::vector<std::string>{}; }
  /// Adds "record" and "recorder_lost" to the report, and "flight" of the ring.
  void tell(nlohmann::ordered_json& report) const;

 private:
  record::Head head_of(const graph::GraphSpec& graph, const Plan& plan, const Transport& transport,
                       const std::string& isolation);
  void begin_file(const graph::RecordSpec& spec, const Plan& plan, const RunBoard& board, Transport& transport,
                  const record::Head& head);

  const Registry& registry_;
  const RunOptions& options_;
  std::optional<mcap::FileSink> file_;
  Disk make_disk_;
  std::unique_ptr<mcap::Sink> disk_;
  VirtualClock written_at_;
  std::list<std::string> texts_;  ///< the head's files
  std::unique_ptr<record::Recorder> recorder_;
  std::unique_ptr<flight::FlightRecorder> flight_;
  record::RecordResult written_;
};

}  // namespace takt::command
