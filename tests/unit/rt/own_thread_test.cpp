// SPDX-License-Identifier: Apache-2.0
#include "rt/own_thread.hpp"

#include <doctest/doctest.h>
#include <sys/mman.h>

#include <atomic>
#include <cstdint>
#include <thread>

#include "rt/memory/process_memory.hpp"

using namespace takt;

TEST_CASE("a thread of the runtime's own has the stack that it asks for, and is joined by its object") {
  size_t left = 0;
  OwnThread([&] { left = stack_left(); }).join();
  CHECK(left > OwnThread::kStack / 2);
#if !defined(TAKT_SANITIZED)  // which gives threads stacks of another size
  CHECK(left <= OwnThread::kStack);
#endif
  OwnThread([&] { left = stack_left(); }, 4 << 20).join();
  CHECK(left > 2 << 20);

#if !defined(TAKT_SANITIZED)
  // What it does not use of its stack is not resident, also where all memory is locked.
  const auto resident = [](OwnThread::Stack stack) {
    int pages = 0;
    const auto count = [&] {
      const auto top = reinterpret_cast<uintptr_t>(__builtin_frame_address(0)) & ~uintptr_t{4095};
      for (uintptr_t page = 8; page < 24; ++page) {
        unsigned char seen = 0;
        REQUIRE(mincore(reinterpret_cast<void*>(top - page * 4096), 4096, &seen) == 0);
        pages += seen & 1;
      }
    };
    OwnThread(count, OwnThread::kStack, stack).join();
    return pages;
  };
  const bool locked = mlockall(MCL_FUTURE) == 0;
  CHECK(resident(OwnThread::Stack::as_used) < 2);
  if (locked) CHECK(resident(OwnThread::Stack::resident) == 16);
  else MESSAGE("not shown: this user may not lock memory");
  munlockall();
#endif

  std::atomic<int> ended{0};
  {
    OwnThread first([&] { ++ended; });
    OwnThread second = std::move(first);
    CHECK_FALSE(first.joinable());
    CHECK(second.joinable());
    second = OwnThread([&] { ++ended; });  // once the one before has ended
    CHECK(ended.load() >= 1);
  }
  CHECK(ended.load() == 2);
}

TEST_CASE("the end of its object asks such a thread to end") {
  bool asked = false;
  {
    const OwnThread thread([&](const std::stop_token& end) {
      while (!end.stop_requested()) std::this_thread::yield();
      asked = true;
    });
  }
  CHECK(asked);
}
