// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/record/recorded_event.hpp>: record, experimental.
// What happened in a run beside its jobs and messages, as a record keeps it.
//
//   for (const RecordedEvent& event : log.events())
//     if (const auto* restart = std::get_if<Restart>(&event.what)) ...
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <variant>
#include <vector>

#include "rt/record/recorded_job.hpp"

namespace takt::record {

/// Numbers stay as they are for good. A reader passes over kinds that it does not know, and bytes behind those that it
/// does.
enum class EventKind : uint16_t {
  restart = 1,   ///< a task goes on in a process that was started again
  parameter,     ///< a parameter was set while the run went on
  mode,          ///< the mode changes
  request,       ///< reserved: start, stop or pace
  mark,          ///< words that a person set
  snapshot,      ///< where a replay may begin: what a task went on from, behind one of its jobs
  machine_lost,  ///< reserved: another machine of the run went away
  level,         ///< reserved: a task's quality level changes; jobs tell theirs
  log,           ///< a node said something (Job::log)
};
/// "restart"; "reserved kind 4 (request)"; "unknown kind 99".
std::string name_of(uint16_t kind);

/// What a restarted task went on from.
struct Restart {
  struct Output {
    uint16_t output = 0;       ///< index into the task's ports
    uint64_t handed_over = 0;  ///< sequence of Output::handed_over(); 0: nothing
    uint64_t newest = 0;       ///< the newest that was out: later ones of a job that was cut off never came out
    bool operator==(const Output&) const = default;
  };
  struct Seen {
    uint16_t edge = 0;      ///< index into the task's edges
    uint64_t sequence = 0;  ///< later ones are new to the node (InputPort::is_new)
    bool operator==(const Seen&) const = default;
  };
  int32_t level = 0;   ///< of the first job
  uint32_t phase = 0;  ///< reserved: where the quality controller stood
  std::vector<Output> outputs;
  std::vector<Seen> seen;
  std::vector<RecordedJob::Param> params;  ///< set before, and taken up before Node::start()
  bool operator==(const Restart&) const = default;
};

/// As if the task had been started again there, and had then been given what it remembered.
struct Snapshot {
  Restart from;
  uint64_t state = 0;  ///< sequence of the task's last output, `state`; 0: its node does not say what it remembers
  bool operator==(const Snapshot&) const = default;
};

/// The job that comes next has it among its own parameters as well.
struct ParameterSet {
  uint16_t param = 0;  ///< index into Node::params()
  ParamValue value;
  std::string who;  ///< "uid 1000"; empty: not told
  bool operator==(const ParameterSet&) const = default;
};

/// In force for jobs released at `at_ns` or later.
struct ModeChange {
  uint32_t mode = 0;  ///< index into Plan::modes
  std::string reason;
  bool operator==(const ModeChange&) const = default;
};

struct MarkSet {
  std::string words;
  std::string who;  ///< as of ParameterSet
  bool operator==(const MarkSet&) const = default;
};

/// Its event has the job that said it.
struct LogSaid {
  uint8_t level = 0;     ///< LogLevel
  uint32_t dropped = 0;  ///< lines of the node that were too many since its line before
  std::string text;
  bool operator==(const LogSaid&) const = default;
};

struct RecordedEvent {
  static constexpr uint16_t kNoTask = UINT16_MAX;
  uint16_t kind = 0;        ///< EventKind, or one that this program does not know
  uint16_t task = kNoTask;  ///< index into Plan::tasks
  uint32_t job = 0;         ///< Job::index() of the job that begins next, or that said it; 0 without a task
  int64_t at_ns = 0;
  std::variant<std::monostate, Restart, ParameterSet, ModeChange, MarkSet, Snapshot, LogSaid>
      what;  ///< monostate: of a kind that is not known
  bool operator==(const RecordedEvent&) const = default;
};

/// Appends kind, task, job, instant and the body of its kind (none of monostate).
void pack(const RecordedEvent& event, std::vector<std::byte>& to);
/// Error: the bytes end within what a known kind has. Unknown kinds are no error.
tl::expected<RecordedEvent, std::string> unpack_event(std::span<const std::byte> packed);

/// How pack() lays an event out, for readers of a record.
const char* event_layout();

}  // namespace takt::record
