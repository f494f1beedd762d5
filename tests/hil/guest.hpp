// SPDX-License-Identifier: Apache-2.0
// What tests in the guest share: real time and commands.
#pragma once
#include <doctest/doctest.h>
#include <time.h>

#include <cerrno>
#include <cstdlib>
#include <fstream>
#include <string>

#include "rt/time/clock.hpp"
#include "tests/nanoseconds.hpp"

namespace takt::test {

inline void sleep_until(int64_t monotonic_ns) {
  const timespec t{monotonic_ns / 1'000'000'000, monotonic_ns % 1'000'000'000};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr) == EINTR) {
  }
}
inline void sleep_for(int64_t ns) { sleep_until(MonotonicClock().now_ns() + ns); }

inline void shell(const std::string& command) { REQUIRE_MESSAGE(std::system(command.c_str()) == 0, command); }

inline std::string from_environment(const char* name) {
  const char* value = std::getenv(name);
  REQUIRE(value != nullptr);
  return value;
}

/// What gpio-sim says of a line: 0 or 1.
inline std::string level_of(const std::string& line) {
  std::string value;
  std::ifstream(from_environment("HIL_GPIO_LINES") + "/" + line + "/value") >> value;
  return value;
}

}  // namespace takt::test
