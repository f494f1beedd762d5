// SPDX-License-Identifier: Apache-2.0
// The heap of programs that link takt_allocation_counter (rt/memory).
#include <doctest/doctest.h>

#include "rt/memory/memory_use.hpp"
#include "rt/memory/sanitized.hpp"

#if !defined(TAKT_SANITIZED)
#include <malloc.h>
#include <mimalloc.h>
#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstdlib>
#include <new>
#include <random>
#include <thread>

#include "rt/memory/job_calls.hpp"
#include "rt/memory/process_memory.hpp"
#include "tests/unit/rt/opaque_malloc.hpp"

using namespace takt;
using namespace takt::test;

namespace {

using Slots = std::array<std::atomic<void*>, 256>;

/// Takes a block of 16 B to 256 kB, and frees one that either thread took.
void step(Slots& slots, std::mt19937& random) {
  void* block = call_malloc(size_t{16} << (random() % 15));
  call_free(slots[random() % slots.size()].exchange(block));
}

/// A thread that takes and frees blocks, and can be stopped wherever it is.
class StoppableUser {
 public:
  explicit StoppableUser(Slots& slots) {
    REQUIRE(pipe(go_on_) == 0);
    struct sigaction action {};
    action.sa_handler = stop;
    sigaction(SIGUSR2, &action, &before_);
    thread_ = std::thread([this, &slots] {
      std::mt19937 random(1);
      while (!end_.load()) step(slots, random);
    });
  }
  ~StoppableUser() {
    end_ = true;
    thread_.join();
    sigaction(SIGUSR2, &before_, nullptr);
    for (const int end : go_on_) close(end);
  }
  StoppableUser(const StoppableUser&) = delete;
  StoppableUser& operator=(const StoppableUser&) = delete;

  void stop_it() {
    stopped_ = false;
    pthread_kill(thread_.native_handle(), SIGUSR2);
    while (!stopped_.load()) std::this_thread::yield();
  }
  /// False if it had already gone on by itself, since nobody came for so long.
  bool let_it_go_on() {
    const char word = 1;
    REQUIRE(write(go_on_[1], &word, 1) == 1);
    while (stopped_.load()) std::this_thread::yield();
    return !gave_up_.load();
  }

 private:
  static void stop(int) {
    constexpr int kPatience_ms = 10'000;  // else a lock that it holds would hang the test
    stopped_ = true;
    pollfd file{go_on_[0], POLLIN, 0};
    char word = 0;
    if (poll(&file, 1, kPatience_ms) != 1 || read(go_on_[0], &word, 1) != 1) gave_up_ = true;
    stopped_ = false;
  }
  static inline int go_on_[2];
  static inline std::atomic<bool> stopped_, gave_up_;
  std::atomic<bool> end_{false};
  struct sigaction before_ {};
  std::thread thread_;
};

}  // namespace

TEST_CASE("a thread takes and frees memory while another is stopped inside malloc or free") {
  Slots slots{};
  bool went_on = true;
  {
    StoppableUser other(slots);
    std::mt19937 random(2);
    for (int round = 0; round < 500 && went_on; ++round) {
      other.stop_it();
      for (int i = 0; i < 100; ++i) step(slots, random);
      went_on = other.let_it_go_on();
    }
  }
  CHECK(went_on);
  for (std::atomic<void*>& slot : slots) call_free(slot);
}

TEST_CASE("whatever takes memory takes it from the heap without locks") {
  void* aligned = nullptr;
  REQUIRE(posix_memalign(&aligned, 64, 100) == 0);
  for (void* block : {call_malloc(10), call_calloc(3, 5), call_realloc(nullptr, 1 << 20), aligned,
                      aligned_alloc(32, 64), memalign(4096, 1), valloc(1), pvalloc(1)}) {
    CHECK(mi_check_owned(block));
    CHECK(malloc_usable_size(block) == mi_usable_size(block));
    call_free(block);
  }
  void* object = ::operator new(100);
  CHECK(mi_check_owned(object));
  ::operator delete(object);
}

TEST_CASE("memory that the heap maps for a job is charged to the job once, as the block") {
  std::array<uint64_t, kJobCalls> counts{};
  JobCalls calls;
  calls.counts = counts.data();
  calls.heap_limit = 50'000'000;
  const uint64_t before = thread_memory_use().allocations;
  constexpr size_t kBytes = 40'000'000;  // more than one of the heap's segments
  int64_t charged = 0;
  void* block = nullptr;
  {
    const JobScope scope(calls);
    block = call_malloc(kBytes);
    charged = calls.heap_bytes;
    call_free(block);
  }
  CHECK(block != nullptr);
  CHECK(charged >= int64_t{kBytes});
  CHECK(charged < calls.heap_limit);
  CHECK(calls.heap_bytes == 0);
  CHECK(thread_memory_use().allocations - before == 1);
  CHECK(counts[static_cast<size_t>(JobCall::malloc)] == 1);
  CHECK(counts[static_cast<size_t>(JobCall::mmap)] == 0);
}

TEST_CASE("large blocks stay in memory where memory is locked") {
  const bool locked = prepare_process_memory().mlock;
  if (!locked) {
    MESSAGE("NOT RUN: this user may not lock memory");
    return;
  }
  for (const size_t bytes : {size_t{12} << 20, size_t{20} << 20, size_t{70} << 20}) {
    CAPTURE(bytes);
    const auto use = [&] {
      auto* block = static_cast<volatile char*>(call_malloc(bytes));
      for (size_t at = 0; at < bytes; at += 4096) block[at] = 1;
      call_free(const_cast<char*>(block));
    };
    use();
    const MemoryUse before = thread_memory_use();
    use();
    CHECK((thread_memory_use() - before).page_faults < 16);
  }
  munlockall();
}

TEST_CASE("a block of no bytes is one; one made to have none is freed") {
  void* block = call_malloc(0);
  CHECK(block != nullptr);
  CHECK(call_realloc(block, 0) == nullptr);
}

#endif
