// SPDX-License-Identifier: Apache-2.0
// Memory and timing preparations of a process that runs real-time jobs. Each one is tried and what was refused is said;
// nothing here fails.
#pragma once
#include <cstddef>
#include <string>
#include <vector>

namespace takt {

struct ProcessMemory {
  bool mlock = false;  ///< all pages, present and future, stay in memory
  /// The C library's heap never gives pages back, never maps blocks of their own, and has one arena. A program that
  /// links takt_allocation_counter takes nothing from it; there, addresses for large blocks are reserved.
  bool malloc = false;
  std::vector<std::string> lacks;  ///< what was refused, each with the fix
};

/// Once, before worker threads start; those get stacks of 2 MB, as all threads do that do not ask for another size
/// (OwnThread). Without it, a large block that OpenCV takes and frees in every job is mapped, faulted in page by page
/// and unmapped again.
ProcessMemory prepare_process_memory();

/// Touches the next `bytes` of the calling thread's stack (at most half of what is left of it), so that no job takes
/// the page fault. Returns the bytes touched.
size_t prefault_stack(size_t bytes = 256 * 1024);

/// Bytes of stack between here and the end of the calling thread's stack.
size_t stack_left();

/// While it lives, the CPUs do not enter sleep states they need long to leave: wake-ups get 2-4 times faster, idle
/// power rises.
class CpuLatencyHold {
 public:
  CpuLatencyHold();
  CpuLatencyHold(CpuLatencyHold&& other) noexcept;
  CpuLatencyHold& operator=(CpuLatencyHold&&) = delete;
  CpuLatencyHold(const CpuLatencyHold&) = delete;
  ~CpuLatencyHold();
  bool granted() const { return file_ >= 0; }
  /// Not granted although the kernel has it. A kernel without idle control has nothing to grant.
  bool refused() const { return !granted() && !absent_; }
  const std::string& lacks() const { return lacks_; }

 private:
  int file_ = -1;
  bool absent_ = false;
  std::string lacks_;
};
[[nodiscard]] CpuLatencyHold hold_cpu_dma_latency();

/// The calling thread's timers fire at their instant, not up to 50 us later (default policy; real-time policies never
/// have slack). Read back; empty if granted, else what was refused.
std::string set_timer_slack();

}  // namespace takt
