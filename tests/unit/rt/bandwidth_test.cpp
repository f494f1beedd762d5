// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/bandwidth.hpp"

#include <doctest/doctest.h>
#include <unistd.h>

#include <thread>

#include "rt/sched/grant.hpp"
#include "tests/has.hpp"

namespace {

using namespace takt;
using test::has;

const std::vector<DeadlineHolder> kHolders{{12, "takt", 9, 0.75}, {7, "stress", 1, 0.1}};

}  // namespace

TEST_CASE("EBUSY of SCHED_DEADLINE is explained by others, by the budgets, or by bandwidth that nobody holds") {
  const std::string others = why_busy(1.2, 0.2, 0.9, kHolders, 99);
  CHECK(has(others, "asked for 1.200 cores, the kernel reserves 0.900 in all"));
  CHECK(has(others, "held by others: takt (pid 12, 9 threads) 0.750, stress (pid 7, 1 thread) 0.100"));
  CHECK(has(why_busy(0.8, 0.2, 0.9, kHolders, 99), "end those, or lower the budgets"));
  const std::string alone = why_busy(1.2, 0.2, 0.9, {{99, "takt", 9, 0.85}}, 99);
  CHECK_FALSE(has(alone, "held by others"));
  CHECK(has(alone, "lower the budgets in the schedule"));
  const std::string lost = why_busy(0.5, 0.2, 1.8, {{99, "takt", 9, 0.3}}, 99);
  CHECK(has(lost, "lost until the kernel counts anew: sudo sysctl kernel.sched_rt_runtime_us="));
}

TEST_CASE("what the kernel reserves follows from its settings") {
  CHECK(deadline_limit(950'000, 1'000'000, 2, 0.05) == doctest::Approx(1.8));
  CHECK(deadline_limit(950'000, 1'000'000, 2, 0) == doctest::Approx(1.9));
  CHECK(deadline_limit(-1, 1'000'000, 2, 0) == doctest::Approx(2));
  CHECK(deadline_limit(0, 1'000'000, 2, 0.05) == 0);
}

TEST_CASE("bandwidth is lost where neither free nor held add up to the limit") {
  CHECK(DeadlineBandwidth{1.8, 0.95, kHolders}.lost() == 0);
  CHECK(DeadlineBandwidth{1.8, 0.947, kHolders}.lost() == 0);  // rounding
  CHECK(DeadlineBandwidth{1.8, 0.85, kHolders}.lost() == doctest::Approx(0.1));
}

TEST_CASE("more than four holders are counted") {
  const std::string text = to_text(std::vector<DeadlineHolder>(6, {1, "a", 1, 0.1}));
  CHECK(text.ends_with(" and 2 more"));
}

TEST_CASE("a thread that is taken out of its reservation holds nothing any more, and takes it back itself") {
  std::thread([] {
    const Reservation wanted = deadline_reservation(1'000'000, 10'000'000, 20'000'000);
    if (!apply(wanted).verified) {
      MESSAGE("NOT RUN: SCHED_DEADLINE is refused to this user");
      return;
    }
    const int thread = gettid();
    REQUIRE(reservation_of(thread).has_value());
    CHECK(reservation_of(thread)->runtime_ns == wanted.runtime_ns);
    std::thread([&] { CHECK(lift_thread(thread, kLowestPriority)); }).join();
    CHECK_FALSE(reservation_of(thread).has_value());
    // Another run may hold for a moment what this thread gave back.
    constexpr int64_t kPatience_ns = 2'000'000'000;
    CHECK((restore_thread(wanted) || apply(wanted, kPatience_ns).verified));
    REQUIRE(reservation_of(thread).has_value());
    CHECK(reservation_of(thread)->period_ns == wanted.period_ns);
  }).join();
}
