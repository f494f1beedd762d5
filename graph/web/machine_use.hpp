// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <map>
#include <vector>

#include "graph/web/hub.hpp"

namespace takt::web {

/// What the processes of a run take of the machine, as the kernel tells anybody: {"cpu": cores since the last look,
/// "memory_mb": what they have for themselves and what they share, once, "host_stall_ms": time that the host of a
/// virtual machine took since the start}. One thread.
class MachineUse {
 public:
  Json look(const std::vector<int>& pids, int64_t now_ns);

 private:
  std::map<int, int64_t> cpu_ticks_;
  int64_t looked_ns_ = 0, stalled_before_ms_ = -1;
};

}  // namespace takt::web
