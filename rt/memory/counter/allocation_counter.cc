// SPDX-License-Identifier: Apache-2.0
// Counts every heap block and mapping the calling thread takes, below operator new: OpenCV and iceoryx allocate with
// posix_memalign and mmap, which operator new never sees. Takes the place of the C library's functions in the program
// that links it and hands on to the C library's own entry points, so nothing is looked up and nothing can recurse.
//
// It also keeps a job from taking more memory than its node may have (JobCalls::heap_limit).
//
// Not a part of takt_rt: a program opts in by linking takt_allocation_counter.
#include <errno.h>
#include <malloc.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "rt/memory/counter/thread_job.hpp"

#if !defined(TAKT_SANITIZED)

// Entry points of glibc that stay its own when the public names are replaced (malloc/malloc.c).
extern "C" {
void* __libc_malloc(size_t);
void* __libc_calloc(size_t, size_t);
void* __libc_realloc(void*, size_t);
void* __libc_memalign(size_t, size_t);
void* __libc_valloc(size_t);
void* __libc_pvalloc(size_t);
void __libc_free(void*);
}

namespace {

using takt::JobCall;
using takt::counter::job;

// Initial-exec: reading it must not itself allocate, as a lazily made thread-local block would.
__attribute__((tls_model("initial-exec"))) thread_local uint64_t allocations = 0;

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

void* taken(void* block) {
  if (job != nullptr && block != nullptr) job->heap_bytes += static_cast<int64_t>(malloc_usable_size(block));
  return block;
}

void given_back(void* block) {
  if (job != nullptr && block != nullptr) job->heap_bytes -= static_cast<int64_t>(malloc_usable_size(block));
}

void* map(void* address, size_t length, int protection, int flags, int file, off_t offset) {
  if (!allowed(length, JobCall::mmap, "mmap")) return MAP_FAILED;
  const long got = syscall(SYS_mmap, address, length, protection, flags, file, offset);
  if (job != nullptr && got != -1) job->heap_bytes += static_cast<int64_t>(length);
  return reinterpret_cast<void*>(got);
}

}  // namespace

extern "C" {

uint64_t takt_thread_allocations() { return allocations; }

void* malloc(size_t size) { return allowed(size, JobCall::malloc, "malloc") ? taken(__libc_malloc(size)) : nullptr; }

void* calloc(size_t count, size_t size) {
  size_t bytes = 0;
  if (__builtin_mul_overflow(count, size, &bytes)) bytes = SIZE_MAX;
  return allowed(bytes, JobCall::malloc, "calloc") ? taken(__libc_calloc(count, size)) : nullptr;
}

void* realloc(void* block, size_t size) {
  if (size != 0 && !allowed(size, JobCall::malloc, "realloc")) return nullptr;
  const size_t before = job != nullptr && block != nullptr ? malloc_usable_size(block) : 0;
  void* got = __libc_realloc(block, size);
  if (job != nullptr && (got != nullptr || size == 0)) job->heap_bytes -= static_cast<int64_t>(before);
  return taken(got);
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
  given_back(block);
  __libc_free(block);
}

void* memalign(size_t alignment, size_t size) {
  return allowed(size, JobCall::malloc, "memalign") ? taken(__libc_memalign(alignment, size)) : nullptr;
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

void* valloc(size_t size) { return allowed(size, JobCall::malloc, "valloc") ? taken(__libc_valloc(size)) : nullptr; }

void* pvalloc(size_t size) { return allowed(size, JobCall::malloc, "pvalloc") ? taken(__libc_pvalloc(size)) : nullptr; }

void* mmap(void* address, size_t length, int protection, int flags, int file, off_t offset) {
  return map(address, length, protection, flags, file, offset);
}

void* mmap64(void* address, size_t length, int protection, int flags, int file, off64_t offset) {
  return map(address, length, protection, flags, file, offset);
}

int munmap(void* address, size_t length) {
  takt::counter::see(JobCall::mmap, "munmap");
  const long done = syscall(SYS_munmap, address, length);
  if (job != nullptr && done == 0) job->heap_bytes -= static_cast<int64_t>(length);
  return static_cast<int>(done);
}

}  // extern "C"

#endif
