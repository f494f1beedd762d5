// SPDX-License-Identifier: Apache-2.0
#include "hal/device_thread.hpp"

#include <doctest/doctest.h>
#include <pthread.h>
#include <sched.h>

#include <thread>

#include "tests/nanoseconds.hpp"

using namespace takt;

namespace {

using takt::test::kMs;

int policy() { return sched_getscheduler(0) & ~SCHED_RESET_ON_FORK; }

bool take_fifo() {
  const sched_param lowest{sched_get_priority_min(SCHED_FIFO)};
  return pthread_setschedparam(pthread_self(), SCHED_FIFO, &lowest) == 0;
}

}  // namespace

TEST_CASE("a thread leaves time until it used more than 80 % of a window, and again after one with less than half") {
  LeavesTime leaves;
  CHECK(leaves.at(0, 70 * kMs));  // what it used before does not count
  CHECK(leaves.at(100 * kMs, 170 * kMs));
  CHECK(leaves.at(200 * kMs, 225 * kMs));    // 155 of 200 ms
  CHECK(leaves.at(399 * kMs, 424 * kMs));    // a window that is not over
  CHECK(!leaves.at(400 * kMs, 390 * kMs));   // 165 of 200 ms
  CHECK(!leaves.at(600 * kMs, 510 * kMs));   // 120 of 200 ms
  CHECK(leaves.at(1'000 * kMs, 700 * kMs));  // 190 of 400 ms
}

TEST_CASE("a device's thread is an ordinary one until a real-time thread runs the driver's jobs") {
  bool granted = false, before = false, after = false;
  const VirtualClock clock;
  DevicePriority priority;
  std::thread([&] {
    granted = take_fifo();
    priority.keep(clock);
    before = policy() == SCHED_OTHER;
    std::thread([&] { priority.follow(); }).join();
    priority.keep(clock);
    before = before && policy() == SCHED_OTHER;
    std::thread([&] {
      if (take_fifo()) priority.follow();
    }).join();
    priority.keep(clock);
    after = policy() == SCHED_FIFO;
  }).join();
  CHECK(before);
  if (granted) CHECK(after);
  else MESSAGE("NOT RUN: SCHED_FIFO is refused to this user");
}
