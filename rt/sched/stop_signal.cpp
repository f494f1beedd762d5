// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/stop_signal.hpp"

#include <algorithm>
#include <cerrno>
#include <ctime>

namespace takt {
namespace {

constexpr int64_t kNever_ns = std::numeric_limits<int64_t>::max();

uint64_t with_check(uint64_t microseconds) {
  return microseconds << 16 | ((microseconds ^ 0x5af0'c3e7'1b96) * 0x9e37'79b9'7f4a'7c15) >> 48;
}

int64_t instant_ns(uint64_t asked) {
  const uint64_t microseconds = asked >> 16;
  return asked == with_check(microseconds) ? static_cast<int64_t>(microseconds) * 1000 : kNever_ns;
}

}  // namespace

void StopSignal::set_planned_end(int64_t end_ns) {
  if (own_ != 0) return;
  std::atomic<int64_t>& planned = words_.front()->planned_end_ns;
  int64_t current = planned.load();
  while (end_ns < current && !planned.compare_exchange_weak(current, end_ns)) {
  }
}

void StopSignal::raise(int64_t now_ns) {
  std::atomic<uint64_t>& asked = words_[own_]->asked;
  uint64_t current = asked.load();
  while (now_ns < instant_ns(current) &&
         !asked.compare_exchange_weak(current, with_check(static_cast<uint64_t>(now_ns) / 1000))) {
  }
}

int64_t StopSignal::asked_ns() const {
  int64_t earliest = kNever_ns;
  for (const StopWord* word : words_)
    if (const uint64_t asked = word->asked.load(std::memory_order_acquire); asked != 0)
      earliest = std::min(earliest, instant_ns(asked));
  return earliest;
}

int64_t StopSignal::end_ns() const {
  return std::min(asked_ns(), words_.front()->planned_end_ns.load(std::memory_order_acquire));
}

TAKT_HOT void StopSignal::sleep_until(int64_t instant_ns) const {
  // clock_nanosleep in slices: a futex that a stop could wake costs 3 us more at every release (queue and hash bucket,
  // both cold), and a slice of a long period costs next to nothing. The last slice ends at the instant itself.
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  int64_t reached = now.tv_sec * 1'000'000'000 + now.tv_nsec;
  while (reached < instant_ns && asked_ns() == kNever_ns) {
    const int64_t slices = (instant_ns - reached - 1) / kReaction_ns;
    const int64_t until_ns = instant_ns - slices * kReaction_ns;
    const timespec until{until_ns / 1'000'000'000, until_ns % 1'000'000'000};
    if (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == 0) reached = until_ns;
  }
}

}  // namespace takt
