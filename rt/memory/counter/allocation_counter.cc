// SPDX-License-Identifier: Apache-2.0
// Counts every heap block and mapping the calling thread takes, below operator new: OpenCV and iceoryx allocate with
// posix_memalign and mmap, which operator new never sees. Takes the place of the C library's functions in the program
// that links it and hands on to the C library's own entry points, so nothing is looked up and nothing can recurse.
//
// Not a part of takt_rt: a program opts in by linking takt_allocation_counter.
#include <errno.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define TAKT_SANITIZED 1
#endif
#endif
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define TAKT_SANITIZED 1
#endif

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

// Initial-exec: reading it must not itself allocate, as a lazily made thread-local block would.
__attribute__((tls_model("initial-exec"))) thread_local uint64_t allocations = 0;

bool power_of_two(size_t n) { return n != 0 && (n & (n - 1)) == 0; }

}  // namespace

extern "C" {

uint64_t takt_thread_allocations() { return allocations; }

void* malloc(size_t size) {
  ++allocations;
  return __libc_malloc(size);
}

void* calloc(size_t count, size_t size) {
  ++allocations;
  return __libc_calloc(count, size);
}

void* realloc(void* block, size_t size) {
  if (size != 0) ++allocations;
  return __libc_realloc(block, size);
}

void* reallocarray(void* block, size_t count, size_t size) {
  size_t bytes = 0;
  if (__builtin_mul_overflow(count, size, &bytes)) {
    errno = ENOMEM;
    return nullptr;
  }
  return realloc(block, bytes);
}

void free(void* block) { __libc_free(block); }

void* memalign(size_t alignment, size_t size) {
  ++allocations;
  return __libc_memalign(alignment, size);
}

void* aligned_alloc(size_t alignment, size_t size) {
  ++allocations;
  return __libc_memalign(alignment, size);
}

int posix_memalign(void** block, size_t alignment, size_t size) {
  if (alignment % sizeof(void*) != 0 || !power_of_two(alignment / sizeof(void*))) return EINVAL;
  ++allocations;
  const int before = errno;
  void* got = __libc_memalign(alignment, size);
  errno = before;
  if (got == nullptr) return ENOMEM;
  *block = got;
  return 0;
}

void* valloc(size_t size) {
  ++allocations;
  return __libc_valloc(size);
}

void* pvalloc(size_t size) {
  ++allocations;
  return __libc_pvalloc(size);
}

void* mmap(void* address, size_t length, int protection, int flags, int file, off_t offset) {
  ++allocations;
  return reinterpret_cast<void*>(syscall(SYS_mmap, address, length, protection, flags, file, offset));
}

void* mmap64(void* address, size_t length, int protection, int flags, int file, off64_t offset) {
  ++allocations;
  return reinterpret_cast<void*>(syscall(SYS_mmap, address, length, protection, flags, file, offset));
}

}  // extern "C"

#endif
