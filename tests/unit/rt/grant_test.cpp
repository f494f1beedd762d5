// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/grant.hpp"

#include <doctest/doctest.h>
#include <sched.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <thread>

namespace {

using namespace takt;

/// How long a turn of the calling thread lasts, ns; 0 where the kernel does not tell (before Linux 6.12).
int64_t slice_ns() {
  struct {  // sched_attr of sched(7)
    uint32_t size, policy;
    uint64_t flags;
    int32_t nice;
    uint32_t priority;
    uint64_t runtime, deadline, period;
  } attributes{};
  REQUIRE(syscall(SYS_sched_getattr, 0, &attributes, sizeof attributes, 0) == 0);
  return static_cast<int64_t>(attributes.runtime);
}

}  // namespace

TEST_CASE("a cooperative worker asks for short turns and stays an ordinary thread, as nice as it was") {
  std::thread([] {
    apply_default();  // the tests may have been started with another policy (chrt --idle)
    REQUIRE(setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), 3) == 0);
    const int64_t before_ns = slice_ns();
    const Grant grant = apply(cooperative_reservation());
    CHECK(grant.policy == Policy::cooperative);
    CHECK(grant.refused.empty());
    CHECK(sched_getscheduler(0) == SCHED_OTHER);
    CHECK(getpriority(PRIO_PROCESS, static_cast<id_t>(gettid())) == 3);
    if (before_ns == 0) MESSAGE("NOT RUN: this kernel gives all ordinary threads turns of the same length");
    else CHECK(slice_ns() == cooperative_reservation().slice_ns);
  }).join();
}
