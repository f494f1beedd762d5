// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

namespace takt::attach {

/// What the processes of a run take of the machine, from what the kernel shows to every user. One thread.
///
///   MachineUse use;
///   while (looking) show(use.look(pids, now_ns).cpu);
class MachineUse {
 public:
  struct Process {
    std::optional<double> cpu;  ///< cores since the last look; nothing at the first one
    double own_mb = 0;          ///< resident memory that is not shared; 0: the process is gone
  };
  struct Use {
    std::optional<double> cpu;       ///< of all processes
    double memory_mb = 0;            ///< what each has for itself, and the largest shared part once
    int64_t host_stall_ms = 0;       ///< time that the host of a virtual machine took since the first look
    std::vector<Process> processes;  ///< in the order of `pids`
  };
  Use look(const std::vector<int>& pids, int64_t now_ns);

 private:
  std::map<int, int64_t> cpu_ticks_;
  int64_t looked_ns_ = 0, stalled_before_ms_ = -1;
};

}  // namespace takt::attach
