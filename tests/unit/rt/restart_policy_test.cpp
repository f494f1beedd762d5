// SPDX-License-Identifier: Apache-2.0
#include "rt/supervise/restart_policy.hpp"

#include <doctest/doctest.h>

#include "tests/nanoseconds.hpp"

using namespace takt;
using test::kSecond;

namespace {
constexpr RestartPolicy::Limits kLimits{.first_wait_ns = 0,
                                        .step_ns = kSecond / 10,
                                        .most_ns = kSecond,
                                        .calm_ns = 5 * kSecond,
                                        .most_in_window = 8,
                                        .window_ns = 100 * kSecond};
}  // namespace

TEST_CASE("a process that lived long is started again at once, one that keeps dying ever later") {
  RestartPolicy policy(kLimits);
  policy.started(0);
  int64_t now = 20 * kSecond;
  CHECK(policy.ended(now) == now);
  for (const int64_t wait : {1, 2, 4, 8, 10, 10}) {  // tenths of a second
    policy.started(now);
    now += kSecond;
    CHECK(policy.ended(now) == now + wait * kSecond / 10);
  }
}

TEST_CASE("a long life in between is a clean sheet for the wait") {
  RestartPolicy policy(kLimits);
  policy.started(0);
  CHECK(policy.ended(1 * kSecond) == 1 * kSecond);
  policy.started(1 * kSecond);
  CHECK(policy.ended(2 * kSecond) > 2 * kSecond);
  policy.started(3 * kSecond);
  CHECK(policy.ended(8 * kSecond) == 8 * kSecond);
}

TEST_CASE("too many ends in a short time are the last; those of long ago do not count") {
  RestartPolicy policy(kLimits);
  int64_t now = 0;
  for (int i = 0; i < 7; ++i) {
    policy.started(now);
    now += kSecond;
    CHECK(policy.ended(now));
  }
  policy.started(now);
  SUBCASE("at once") { CHECK_FALSE(policy.ended(now + kSecond)); }
  SUBCASE("when the first ones are forgotten") { CHECK(policy.ended(now + 95 * kSecond)); }
}
