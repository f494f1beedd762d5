// SPDX-License-Identifier: Apache-2.0
#include "graph/attach/machine_use.hpp"

#include <doctest/doctest.h>
#include <unistd.h>

using takt::attach::MachineUse;

TEST_CASE(
    "what processes take: memory at once, CPU time from the second look on; a process that is gone takes nothing") {
  constexpr int kNobody = 1 << 23;  // above the largest process id
  MachineUse use;
  const MachineUse::Use first = use.look({getpid(), kNobody}, 1'000'000'000);
  REQUIRE(first.processes.size() == 2);
  CHECK(!first.cpu);
  CHECK(!first.processes[0].cpu);
  CHECK(first.processes[0].own_mb > 0);
  CHECK(first.memory_mb > first.processes[0].own_mb);
  CHECK(first.processes[1].own_mb == 0);
  CHECK(first.host_stall_ms == 0);
  const MachineUse::Use second = use.look({getpid(), kNobody}, 1'000'000'000'000);
  REQUIRE(second.cpu);
  CHECK(*second.cpu >= 0);
  CHECK(*second.cpu < 1);  // 999 s are said to have passed
  CHECK(second.processes[1].cpu == 0.0);
  CHECK(use.look({}, 2'000'000'000'000).processes.empty());
}
