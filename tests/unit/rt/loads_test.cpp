// SPDX-License-Identifier: Apache-2.0
// Loads on the machine begin when there is an epoch and end when they are told to.
#include <doctest/doctest.h>

#include <thread>

#include "rt/faults/load.hpp"
#include "rt/time/clock.hpp"

namespace {

using namespace takt;
using namespace takt::faults;

/// Until it has struck that often, however long it takes.
void wait_for(const LoadCount& struck, uint64_t times) {
  while (struck.load() < times) std::this_thread::yield();
}

}  // namespace

TEST_CASE("loads run in as many threads as asked, and end with their object") {
  std::atomic<int64_t> epoch{MonotonicClock().now_ns()};
  LoadCount cpu{0}, memory{0};
  LoadFault hog;
  hog.threads = 2;
  LoadFault block;
  block.kind = LoadFault::Kind::memory;
  block.bytes = 1'000'000;
  {
    const Loads loads({hog, block}, epoch, {&cpu, &memory});
    wait_for(cpu, 2);
    wait_for(memory, 1);
  }
  CHECK(cpu == 2);
  CHECK(memory == 1);
}

TEST_CASE("no load begins before its window, or without an epoch; memory that nobody has is not got") {
  std::atomic<int64_t> epoch{0}, begun{MonotonicClock().now_ns()};
  LoadCount early{0}, late{0}, greedy{0}, marker{0};
  LoadFault hog, later;
  later.from_ns = 3'600'000'000'000;
  LoadFault block;
  block.kind = LoadFault::Kind::memory;
  block.bytes = uint64_t{1} << 60;
  {
    const Loads without({hog}, epoch, {&early});
    const Loads loads({later, block, hog}, begun, {&late, &greedy, &marker});
    wait_for(marker, 1);
  }
  CHECK(early == 0);
  CHECK(late == 0);
  CHECK(greedy == 0);
}
