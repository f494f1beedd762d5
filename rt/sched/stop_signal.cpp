// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/stop_signal.hpp"

#include <cerrno>
#include <ctime>

#include "rt/hot.hpp"

namespace takt {

void StopSignal::lower(int64_t end_ns) {
  int64_t current = end_.load();
  while (end_ns < current && !end_.compare_exchange_weak(current, end_ns)) {
  }
}

void StopSignal::raise(int64_t now_ns) {
  lower(now_ns);
  raised_.store(true);
}

TAKT_HOT void StopSignal::sleep_until(int64_t instant_ns) const {
  // clock_nanosleep in slices: a futex that a stop could wake costs 3 us more at every release (queue and hash bucket,
  // both cold), and a slice of a long period costs next to nothing. The last slice ends at the instant itself.
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  int64_t reached = now.tv_sec * 1'000'000'000 + now.tv_nsec;
  while (!raised_.load(std::memory_order_relaxed) && reached < instant_ns) {
    const int64_t slices = (instant_ns - reached - 1) / kReaction_ns;
    const int64_t until_ns = instant_ns - slices * kReaction_ns;
    const timespec until{until_ns / 1'000'000'000, until_ns % 1'000'000'000};
    if (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == 0) reached = until_ns;
  }
}

}  // namespace takt
