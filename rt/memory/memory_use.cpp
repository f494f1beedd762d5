// SPDX-License-Identifier: Apache-2.0
#include "rt/memory/memory_use.hpp"

#include <sys/resource.h>

#include <utility>

#include "rt/time/thread_clock.hpp"

// Defined by takt_allocation_counter where a program links it, null otherwise.
extern "C" __attribute__((weak)) uint64_t takt_thread_allocations();

namespace takt {

bool counting_allocations() { return takt_thread_allocations != nullptr; }

MemoryUse thread_memory_use() {
  MemoryUse use;
  if (counting_allocations()) use.allocations = takt_thread_allocations();
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  use.page_faults = static_cast<uint64_t>(usage.ru_minflt + usage.ru_majflt);
  return use;
}

namespace {
thread_local ThreadUse last;
}

int64_t last_thread_use_ns() { return last.cpu_ns; }

ThreadUse take_thread_use() {
  const ThreadUse now{thread_cpu_fast_ns(), counting_allocations() ? takt_thread_allocations() : 0};
  const ThreadUse used{now.cpu_ns - last.cpu_ns, now.allocations - last.allocations};
  last = now;
  return used;
}

uint64_t take_page_faults() {
  thread_local uint64_t last = 0;
  const uint64_t now = thread_memory_use().page_faults;
  return now - std::exchange(last, now);
}

}  // namespace takt
