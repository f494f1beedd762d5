// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>
#include <malloc.h>
#include <sys/mman.h>
#include <sys/resource.h>

#include <cstdlib>
#include <memory>
#include <thread>

#include "rt/memory/counter/thread_job.hpp"
#include "rt/memory/memory_use.hpp"
#include "rt/memory/process_memory.hpp"
#include "tests/unit/rt/opaque_malloc.hpp"

using namespace takt;
using namespace takt::test;

namespace {

int (*volatile call_posix_memalign)(void**, size_t, size_t) = posix_memalign;
void* (*volatile call_aligned_alloc)(size_t, size_t) = std::aligned_alloc;
void* (*volatile call_memalign)(size_t, size_t) = memalign;
void* (*volatile call_mmap)(void*, size_t, int, int, int, off_t) = mmap;

uint64_t allocations() { return thread_memory_use().allocations; }

}  // namespace

TEST_CASE("every way to take memory counts, giving it back does not") {
  if (!counting_allocations()) {
    MESSAGE("NOT RUN: this program does not count allocations (sanitizer, or takt_allocation_counter not linked)");
    return;
  }
  const uint64_t start = allocations();
  CHECK(allocations() == start);
  void* a = call_malloc(100);
  CHECK(allocations() == start + 1);
  a = call_realloc(a, 100'000);
  CHECK(allocations() == start + 2);
  void* b = call_calloc(10, 10);
  CHECK(static_cast<char*>(b)[99] == 0);
  CHECK(allocations() == start + 3);
  void* c = nullptr;
  REQUIRE(call_posix_memalign(&c, 4096, 10) == 0);
  CHECK(reinterpret_cast<uintptr_t>(c) % 4096 == 0);
  CHECK(call_posix_memalign(&c, 3, 10) == EINVAL);
  CHECK(allocations() == start + 4);
  void* d = call_aligned_alloc(64, 128);
  CHECK(reinterpret_cast<uintptr_t>(d) % 64 == 0);
  void* e = call_memalign(256, 1);
  CHECK(reinterpret_cast<uintptr_t>(e) % 256 == 0);
  CHECK(allocations() == start + 6);
  auto f = std::make_unique<int[]>(1000);
  CHECK(allocations() == start + 7);
  void* g = call_mmap(nullptr, 4096, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  REQUIRE(g != MAP_FAILED);
  CHECK(allocations() == start + 8);
  CHECK(call_mmap(nullptr, 0, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0) == MAP_FAILED);
  const uint64_t end = allocations();
  munmap(g, 4096);
  for (void* block : {a, b, c, d, e}) call_free(block);
  f.reset();
  CHECK(allocations() == end);
}

TEST_CASE("a thread sees its own allocations only") {
  if (!counting_allocations()) {
    MESSAGE("NOT RUN: this program does not count allocations (sanitizer, or takt_allocation_counter not linked)");
    return;
  }
  uint64_t theirs = 0;
  std::thread other([&] {
    const uint64_t before = allocations();
    for (int i = 0; i < 1000; ++i) call_free(call_malloc(64));
    theirs = allocations() - before;
  });
  const uint64_t before = allocations();
  other.join();
  CHECK(theirs == 1000);
  CHECK(allocations() - before < 10);
}

TEST_CASE("page faults of fresh pages are counted") {
  constexpr size_t kPages = 64;
  auto* pages = static_cast<volatile char*>(
      mmap(nullptr, kPages * 4096, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0));
  REQUIRE(const_cast<char*>(pages) != MAP_FAILED);
  madvise(const_cast<char*>(pages), kPages * 4096, MADV_NOHUGEPAGE);
  const MemoryUse before = thread_memory_use();
  for (size_t i = 0; i < kPages; ++i) pages[i * 4096] = 1;
  const MemoryUse used = thread_memory_use() - before;
  CHECK(used.page_faults >= kPages);
  const MemoryUse again = thread_memory_use();
  for (size_t i = 0; i < kPages; ++i) pages[i * 4096] = 2;
  CHECK((thread_memory_use() - again).page_faults < kPages);
  munmap(const_cast<char*>(pages), kPages * 4096);
}

TEST_CASE("a stack is prefaulted, and never beyond its end") {
  std::thread([] {
    const auto top = reinterpret_cast<uintptr_t>(__builtin_frame_address(0)) & ~uintptr_t{4095};
    const auto resident = [&] {
      int pages = 0;
      for (uintptr_t page = 1; page < 24; ++page) {
        unsigned char seen = 0;
        REQUIRE(mincore(reinterpret_cast<void*>(top - page * 4096), 4096, &seen) == 0);
        pages += seen & 1;
      }
      return pages;
    };
    CHECK(stack_left() > 64 * 1024);
    CHECK(resident() < 23);
    CHECK(prefault_stack(100'000) == 24 * 4096);
    CHECK(resident() == 23);
#if !defined(TAKT_SANITIZED)  // a sanitizer keeps records in pages of its own
    const MemoryUse before = thread_memory_use();
    CHECK(prefault_stack(100'000) == 24 * 4096);
    CHECK((thread_memory_use() - before).page_faults < 4);
#endif
    CHECK(prefault_stack(size_t{1} << 40) <= stack_left());
  }).join();
}

TEST_CASE("what the process was refused is said with the fix") {
  const ProcessMemory got = prepare_process_memory();
  CHECK((got.malloc || !counting_allocations()));  // a sanitizer's malloc takes no options, and is not counted either
  CHECK(got.lacks.size() == size_t{!got.malloc} + size_t{!got.mlock});
  for (const std::string& lack : got.lacks) CHECK(lack.find("Fix: ") != std::string::npos);
  munlockall();
  const CpuLatencyHold hold = hold_cpu_dma_latency();
  CHECK(hold.granted() == hold.lacks().empty());
  CHECK(set_timer_slack().empty());
}

TEST_CASE("large blocks come from the heap once the process is prepared, and stay there") {
  if (!counting_allocations()) {
    MESSAGE("NOT RUN: this program's malloc is a sanitizer's, or takt_allocation_counter is not linked");
    return;
  }
  prepare_process_memory();
  munlockall();
  constexpr size_t kBytes = 4 << 20;
  const auto use = [] {
    auto* block = static_cast<volatile char*>(call_malloc(kBytes));
    for (size_t i = 0; i < kBytes; i += 4096) block[i] = 1;
    call_free(const_cast<char*>(block));
  };
  use();
  const MemoryUse before = thread_memory_use();
  use();
  CHECK((thread_memory_use() - before).page_faults < 16);
}
