// SPDX-License-Identifier: Apache-2.0
#include "rt/time/clock.hpp"

#include <ctime>

#include "rt/hot.hpp"

namespace takt {
namespace {
int64_t read(clockid_t id) {
  timespec ts{};
  clock_gettime(id, &ts);
  return int64_t{ts.tv_sec} * 1'000'000'000 + ts.tv_nsec;
}
}  // namespace

TAKT_HOT int64_t MonotonicClock::now_ns() const { return read(CLOCK_MONOTONIC); }
int64_t thread_cpu_ns() { return read(CLOCK_THREAD_CPUTIME_ID); }

}  // namespace takt
