// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <sys/types.h>

#include <utility>
#include <vector>

#include "graph/compose/partition.hpp"
#include "graph/run/faults.hpp"
#include "rt/supervise/process_group.hpp"

namespace takt::command {

/// What a scenario has in store for the processes of a run: kills them, stops them for a while, or orders them to die
/// at a step of their work. On the thread that supervises them.
class Strikes {
 public:
  /// All given outlives this.
  Strikes(RunFaults& faults, const Plan& plan, const graph::Partition& partition, RunBoard& board, ProcessGroup& group)
      : faults_(faults), plan_(plan), partition_(partition), board_(board), group_(group) {}
  /// What is due, and lets those go on whose time is over.
  void strike(int64_t now_ns);

 private:
  void order(size_t process, const graph::ProcessStrike& strike);

  RunFaults& faults_;
  const Plan& plan_;
  const graph::Partition& partition_;
  RunBoard& board_;
  ProcessGroup& group_;
  std::vector<std::pair<pid_t, int64_t>> stopped_;  ///< processes, and when they go on
};

}  // namespace takt::command
