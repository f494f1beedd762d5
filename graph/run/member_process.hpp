// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <chrono>
#include <functional>

#include "graph/compose/composition.hpp"
#include "graph/compose/partition.hpp"
#include "graph/run/faults.hpp"
#include "graph/run/run.hpp"
#include "graph/run/told_lines.hpp"
#include "rt/sched/run_board.hpp"
#include "rt/shm/local_transport.hpp"
#include "rt/trace/rings.hpp"

namespace takt::command {

/// Facts over the board. The waits poll: they are used before the start only.
class BoardExchange final : public graph::FactExchange {
 public:
  explicit BoardExchange(RunBoard& board) : board_(board) {}
  void tell(size_t port, const std::optional<Capacity>& capacity) override;
  void tell_counts(size_t port, const ArrayCounts& counts) override { board_.capacity(port).counts = counts; }
  ArrayCounts counts(size_t port) override { return board_.capacity(port).counts; }
  std::optional<Capacity> wait_for(size_t port) override;
  void tell_source(size_t task, const SourcePlan& source) override;
  SourcePlan wait_for_source(size_t task) override;

 private:
  RunBoard& board_;
};

/// Looks every so often until `done` or, where given, `broken`; true if done.
bool wait_until(const std::function<bool()>& done, const std::function<bool()>& broken = {},
                std::chrono::milliseconds between_looks = std::chrono::milliseconds(1));

/// What one process of an isolated run is given.
struct MemberPart {
  const Registry& registry;
  const RunOptions& options;
  const graph::GraphSpec& graph;
  const graph::Partition& partition;
  const analysis::Overheads& overheads;  ///< the supervisor's, so that all put lanes on the same cores
  size_t process = 0;                    ///< index into partition.names
  bool spare = false;                    ///< it takes the place of the process when that has died
  int supervisor = 0;                    ///< the process whose daemon it may have to join
  int run = 0;                           ///< the process that stands for the run
  RunBoard& board;
  const PoolFile& pools;
  trace::Rings* rings = nullptr;  ///< null: not traced
  RunFaults& faults;
  ToldLines& left_out;
  ToldLines& machines;  ///< what the link has seen of others, a line of JSON
};

/// One process of an isolated run, as the supervisor's fork enters it: composes its part, joins the transport that the
/// board names, runs until the board's stop. Returns the exit code. A spare has its part composed, its memory locked
/// and the pools mapped, and waits then until the board says that the place is its own; before that it writes nothing
/// that the process uses.
int run_member(const MemberPart& part);

}  // namespace takt::command
