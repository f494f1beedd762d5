// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "graph/attach/server.hpp"
#include "graph/rewind/recorded_run.hpp"
#include "rt/sched/node_log.hpp"
#include "rt/sched/run_board.hpp"

namespace takt::rewind {

/// A replay at the pace of its record that can be looked at as a run can (`takt top`, `takt echo`, `takt web`):
///
///   ShownReplay shown(run, registry, run.parts().front().how);   // after compose()
///   run.run(shown.how());
///
/// What the jobs make, and what the record has of devices and of nodes that are not run, stands in a transport of its
/// own, jobs and events on a board of its own; all instants are moved to now. Who looks changes nothing of the replay.
/// One thread, apart from those who look.
class ShownReplay {
 public:
  /// `how` waits before each job. All given outlives this. Throws std::runtime_error where there is no memory for it.
  ShownReplay(RecordedRun& run, const Registry& registry, record::Replayer::Options how);
  ShownReplay(const ShownReplay&) = delete;
  ShownReplay& operator=(const ShownReplay&) = delete;

  const record::Replayer::Options& how() const { return how_; }
  const attach::Server& server() const { return server_; }

 private:
  struct Port {
    std::unique_ptr<Writer> writer;
    bool recorded = false;  ///< its messages come from the record, no job that runs makes them
    uint16_t channel = 0;
    uint64_t told = 0;             ///< sequence of the newest message that is out
    int64_t due_ns = INT64_MIN;    ///< of the message behind it, where that is known
    std::vector<std::byte> bytes;  ///< packed
  };

  attach::Subject subject(const Registry& registry);
  int64_t now_of(int64_t recorded_ns) const { return recorded_ns + *moved_ns_; }
  void begin(int64_t release_ns);
  void come_to(int64_t recorded_ns);
  void take_messages(size_t port, int64_t until_ns);
  void take_event(const record::RecordedEvent& event);
  bool show(const record::Replayer& replayer, const record::RecordedJob& job);
  void note(const record::RecordedJob& job);
  void publish(size_t port, const MessageHeader& header, std::span<const std::byte> packed);

  RecordedRun& run_;
  record::Replayer::Options how_;
  std::optional<int64_t> moved_ns_;  ///< what is added to instants of the record; nothing: it has not begun
  RunBoard board_;
  std::unique_ptr<Transport> transport_;
  std::vector<Port> ports_;
  std::vector<const record::RecordedJob*> others_;  ///< of tasks that do not run, by publication
  std::vector<LogWriter> logs_;                     ///< by task
  size_t next_other_ = 0, next_event_ = 0;
  uint32_t mode_ = 0;
  attach::Server server_;
};

}  // namespace takt::rewind
