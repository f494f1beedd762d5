// SPDX-License-Identifier: Apache-2.0
// Counts every heap block and mapping the calling thread takes, below operator new: OpenCV and iceoryx allocate with
// posix_memalign and mmap, which operator new never sees. Takes the place of the C library's functions in the program
// that links it.
//
// The memory comes from mimalloc, where each thread has a heap of its own and no lock: in the C library's a real-time
// thread waits for an ordinary one that was preempted inside malloc or free (tests/endurance/allocations.cpp).
//
// It also keeps a job from taking more memory than its node may have (JobCalls::heap_limit).
//
// Not a part of takt_rt: a program opts in by linking takt_allocation_counter.
#include <errno.h>
#include <mimalloc.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "rt/memory/counter/thread_job.hpp"

#if !defined(TAKT_SANITIZED)

namespace {

using takt::JobCall;
using takt::counter::job;

// Initial-exec: reading it must not itself allocate, as a lazily made thread-local block would.
__attribute__((tls_model("initial-exec"))) thread_local uint64_t allocations = 0;

// Before the first block, and before the constructors of libraries, which take some. Memory is committed as it is
// needed, where mlockall would put the 32 MiB that each thread's heap reserves into memory at once, and kept.
void set_up_heap() {
  mi_option_set(mi_option_eager_commit, 0);
  mi_option_set(mi_option_allow_decommit, 0);
}
__attribute__((section(".preinit_array"), used)) void (*const before_constructors)() = set_up_heap;

// Mappings that the heap itself makes are no mappings of the thread or the job: they are seen as their malloc.
__attribute__((tls_model("initial-exec"))) thread_local bool in_heap = false;

/// What `call` returns, by the heap.
template <class F>
auto from_heap(F call) {
  in_heap = true;
  const auto got = call();
  in_heap = false;
  return got;
}

bool power_of_two(size_t n) { return n != 0 && (n & (n - 1)) == 0; }

/// False if a job may have no more memory; of other threads nothing is asked.
bool allowed(size_t bytes, JobCall call, const char* function) {
  ++allocations;
  if (job == nullptr) return true;
  takt::counter::note(call, function);
  // Compared so that nothing can overflow: heap_bytes is negative where jobs free what was taken outside of them.
  if (bytes <= INT64_MAX && job->heap_bytes <= job->heap_limit - static_cast<int64_t>(bytes)) return true;
  constexpr int64_t kMostNoted = int64_t{1} << 40;  // a job may ask, and be refused, any number of times
  job->heap_refused += bytes < kMostNoted ? static_cast<int64_t>(bytes) : kMostNoted;
  errno = ENOMEM;
  return false;
}

template <class F>
void* taken(F call) {
  void* block = from_heap(call);
  if (block == nullptr) errno = ENOMEM;
  else if (job != nullptr) job->heap_bytes += static_cast<int64_t>(mi_usable_size(block));
  return block;
}

void* map(void* address, size_t length, int protection, int flags, int file, off_t offset) {
  if (!in_heap && !allowed(length, JobCall::mmap, "mmap")) return MAP_FAILED;
  const long got = syscall(SYS_mmap, address, length, protection, flags, file, offset);
  if (job != nullptr && !in_heap && got != -1) job->heap_bytes += static_cast<int64_t>(length);
  return reinterpret_cast<void*>(got);
}

}  // namespace

extern "C" {

uint64_t takt_thread_allocations() { return allocations; }

// Reserves addresses, not memory, once per process. Blocks above 16 MiB come from there: elsewhere each of them would
// be mapped, faulted in and unmapped. Returns 0 or an errno.
int takt_reserve_heap() {
  constexpr size_t kAddresses = size_t{4} << 30;
  static const int reason = from_heap([] { return mi_reserve_os_memory(kAddresses, false, false); });
  return reason;
}

void* malloc(size_t size) {
  if (!allowed(size, JobCall::malloc, "malloc")) return nullptr;
  return taken([=] { return mi_malloc(size); });
}

void* calloc(size_t count, size_t size) {
  size_t bytes = 0;
  if (__builtin_mul_overflow(count, size, &bytes)) bytes = SIZE_MAX;
  if (!allowed(bytes, JobCall::malloc, "calloc")) return nullptr;
  return taken([=] { return mi_calloc(count, size); });
}

void* realloc(void* block, size_t size) {
  if (block != nullptr && size == 0) {
    free(block);
    return nullptr;
  }
  if (!allowed(size, JobCall::malloc, "realloc")) return nullptr;
  const size_t before = job != nullptr ? mi_usable_size(block) : 0;
  void* got = taken([=] { return mi_realloc(block, size); });
  if (job != nullptr && got != nullptr) job->heap_bytes -= static_cast<int64_t>(before);
  return got;
}

void* reallocarray(void* block, size_t count, size_t size) {
  size_t bytes = 0;
  if (__builtin_mul_overflow(count, size, &bytes)) {
    errno = ENOMEM;
    return nullptr;
  }
  return realloc(block, bytes);
}

void free(void* block) {
  if (job != nullptr) job->heap_bytes -= static_cast<int64_t>(mi_usable_size(block));
  in_heap = true;
  mi_free(block);
  in_heap = false;
}

size_t malloc_usable_size(void* block) { return mi_usable_size(block); }

void* memalign(size_t alignment, size_t size) {
  if (!allowed(size, JobCall::malloc, "memalign")) return nullptr;
  return taken([=] { return mi_memalign(alignment, size); });
}

void* aligned_alloc(size_t alignment, size_t size) { return memalign(alignment, size); }

int posix_memalign(void** block, size_t alignment, size_t size) {
  if (alignment % sizeof(void*) != 0 || !power_of_two(alignment / sizeof(void*))) return EINVAL;
  const int before = errno;
  void* got = memalign(alignment, size);
  errno = before;
  if (got == nullptr) return ENOMEM;
  *block = got;
  return 0;
}

void* valloc(size_t size) {
  if (!allowed(size, JobCall::malloc, "valloc")) return nullptr;
  return taken([=] { return mi_valloc(size); });
}

void* pvalloc(size_t size) {
  if (!allowed(size, JobCall::malloc, "pvalloc")) return nullptr;
  return taken([=] { return mi_pvalloc(size); });
}

void* mmap(void* address, size_t length, int protection, int flags, int file, off_t offset) {
  return map(address, length, protection, flags, file, offset);
}

void* mmap64(void* address, size_t length, int protection, int flags, int file, off64_t offset) {
  return map(address, length, protection, flags, file, offset);
}

int munmap(void* address, size_t length) {
  if (!in_heap) takt::counter::see(JobCall::mmap, "munmap");
  const long done = syscall(SYS_munmap, address, length);
  if (job != nullptr && !in_heap && done == 0) job->heap_bytes -= static_cast<int64_t>(length);
  return static_cast<int>(done);
}

}  // extern "C"

#endif
