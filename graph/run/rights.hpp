// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <sys/types.h>

#include <string>
#include <vector>

#include "hal/settings/json.hpp"
#include "rt/own_thread.hpp"
#include "rt/sched/run_board.hpp"

namespace takt::command {

/// Reads once, when all are at work (half a second after the epoch), which capabilities the threads of a run hold: that
/// each gives up what it does not need is not believed but read back. From an ordinary thread.
class RunRights {
 public:
  struct Process {
    std::string name;
    pid_t pid;
  };
  /// This process comes last, if it is among them. The board outlives it.
  RunRights(RunBoard& board, std::vector<Process> processes);
  /// For the report's key `rights`: of each process how many threads it has, and how many of them hold CAP_SYS_NICE
  /// (`real_time`), CAP_IPC_LOCK (`lock_memory`), or anything else. Null if the run was over before.
  nlohmann::ordered_json told();

 private:
  nlohmann::ordered_json read_;
  OwnThread thread_;  ///< last: it uses all of the above
};

}  // namespace takt::command
