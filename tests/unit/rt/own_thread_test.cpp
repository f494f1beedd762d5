// SPDX-License-Identifier: Apache-2.0
#include "rt/own_thread.hpp"

#include <doctest/doctest.h>

#include <atomic>
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
