// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <deque>
#include <mutex>
#include <optional>
#include <string>

#include "graph/flight/triggers.hpp"
#include "rt/sched/run_board.hpp"
#include "rt/trace/collector.hpp"

namespace takt::flight {

/// What a frozen file says beside its messages.
struct Said {
  std::string sentence;  ///< why, as `takt explain` says it of a miss
  std::string trace;     ///< of the window, as `takt run --trace` writes it
  std::string report;    ///< what each node has done so far: JSON
};

/// Keeps what jobs noted last, and makes a trace of it. Any thread; noting takes as long as a lock.
class Evidence {
 public:
  /// All given outlives this.
  Evidence(const graph::GraphSpec& graph, const Plan& plan, const RunBoard& board, int64_t keep_ns)
      : graph_(graph), plan_(plan), board_(board), keep_ns_(keep_ns) {}
  void note(int32_t ring, const trace::Event& event);
  Said say(const Cause& cause, int64_t from_ns, int64_t to_ns) const;

 private:
  trace::Trace trace_of(int64_t from_ns, int64_t to_ns) const;
  std::string report() const;

  const graph::GraphSpec& graph_;
  const Plan& plan_;
  const RunBoard& board_;
  const int64_t keep_ns_;
  mutable std::mutex mutex_;
  std::deque<trace::ThreadEvent> events_;
};

}  // namespace takt::flight
