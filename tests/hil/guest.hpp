// SPDX-License-Identifier: Apache-2.0
// What tests in the guest share: real time and commands.
#pragma once
#include <doctest/doctest.h>
#include <time.h>

#include <cerrno>
#include <cstdlib>
#include <string>

#include "rt/time/clock.hpp"

namespace takt::test {

constexpr int64_t kMs = 1'000'000;

inline void sleep_until(int64_t monotonic_ns) {
  const timespec t{monotonic_ns / 1'000'000'000, monotonic_ns % 1'000'000'000};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr) == EINTR) {
  }
}
inline void sleep_for(int64_t ns) { sleep_until(MonotonicClock().now_ns() + ns); }

inline void shell(const std::string& command) { REQUIRE_MESSAGE(std::system(command.c_str()) == 0, command); }

}  // namespace takt::test
