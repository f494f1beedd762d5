// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/stop_signal.hpp"

#include <linux/futex.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <climits>
#include <ctime>

namespace takt {

void StopSignal::lower(int64_t end_ns) {
  int64_t current = end_.load();
  while (end_ns < current && !end_.compare_exchange_weak(current, end_ns)) {
  }
}

void StopSignal::raise(int64_t now_ns) {
  lower(now_ns);
  raised_.store(1);
  syscall(SYS_futex, reinterpret_cast<uint32_t*>(&raised_), FUTEX_WAKE_PRIVATE, INT_MAX, nullptr, nullptr, 0);
}

void StopSignal::sleep_until(int64_t instant_ns) const {
  // A futex with an absolute CLOCK_MONOTONIC timeout: the same timer as clock_nanosleep, but a stop ends it.
  timespec until{};
  until.tv_sec = instant_ns / 1'000'000'000;
  until.tv_nsec = instant_ns % 1'000'000'000;
  while (raised_.load() == 0) {
    const long rc = syscall(SYS_futex, reinterpret_cast<const uint32_t*>(&raised_), FUTEX_WAIT_BITSET_PRIVATE, 0,
                            &until, nullptr, FUTEX_BITSET_MATCH_ANY);
    if (rc != 0 && errno == ETIMEDOUT) return;  // anything else was a signal or a spurious wake-up
  }
}

}  // namespace takt
