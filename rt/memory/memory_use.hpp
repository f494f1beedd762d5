// SPDX-License-Identifier: Apache-2.0
// What the calling thread has cost the memory system so far. The difference around a job is what the job cost.
#pragma once
#include <cstdint>

namespace takt {

struct MemoryUse {
  uint64_t allocations = 0;  ///< heap blocks and mappings taken: malloc, calloc, realloc, aligned forms, mmap
  uint64_t page_faults = 0;  ///< minor and major
  MemoryUse operator-(const MemoryUse& earlier) const {
    return {allocations - earlier.allocations, page_faults - earlier.page_faults};
  }
};

/// Of the calling thread since its start. Costs one system call (about 0.3 us), allocates nothing. Allocations stay 0
/// where counting_allocations() is false.
MemoryUse thread_memory_use();

/// What a job cost its thread.
struct ThreadUse {
  int64_t cpu_ns = 0;
  uint64_t allocations = 0;
};
/// What the calling thread has used since it last asked (the first time: since its start). A job's cost is asked for
/// once, at its end: so it contains the wake-up and the latching, which the kernel charges to a reservation too, and
/// nothing but a reading of the clock stands between a release and the job.
ThreadUse take_thread_use();
/// Reading of the calling thread's CPU clock when it last asked, ns.
int64_t last_thread_use_ns();
/// Page faults of the calling thread since it last asked. A system call of its own, which a lane makes once for all of
/// its jobs.
uint64_t take_page_faults();

/// True if this program counts allocations: it is linked with takt_allocation_counter and no sanitizer replaces malloc.
bool counting_allocations();

}  // namespace takt
