// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/anticipation.hpp"

#include <algorithm>

#include "rt/hot.hpp"
#include "rt/memory/memory_use.hpp"

namespace takt {

TAKT_HOT bool Anticipation::sleep_before(int64_t release_ns, const Clock& clock, const StopSignal& stop) {
  if (longest_ns_ == 0 || rest_ > 0) {
    if (rest_ > 0) --rest_;
    stop.sleep_until(release_ns);
    return false;
  }
  const int64_t asked_ns = release_ns - lead_ns_;
  // Who comes late from the job before is not woken, and learns nothing about it.
  const bool sleeps = clock.now_ns() < asked_ns;
  stop.sleep_until(asked_ns);
  const int64_t now_ns = clock.now_ns();
  if (now_ns < asked_ns) return false;  // a stop
  if (sleeps) learn(now_ns - asked_ns);
  return now_ns < release_ns;
}

TAKT_HOT void Anticipation::stay_awake_until(int64_t release_ns, const Clock& clock) {
  int64_t before_ns = clock.now_ns(), longest_gap_ns = 0;
  while (before_ns < release_ns) {
    take_thread_use();
    const int64_t now_ns = clock.now_ns();
    longest_gap_ns = std::max(longest_gap_ns, now_ns - before_ns);
    before_ns = now_ns;
  }
  if (beside_ == Beside::workers) return;
  if (longest_gap_ns >= kLostCpu_ns) {
    rest_ = next_rest_;
    next_rest_ = std::min(2 * next_rest_, kLongestRest);
  } else if (next_rest_ > kShortestRest) {
    --next_rest_;
  }
}

void Anticipation::learn(int64_t took_ns) {
  // Steps of fixed size, so that one outlier moves it no more than any other: up four times as far as down, it rests
  // where four of five are shorter.
  lead_ns_ = std::clamp<int64_t>(lead_ns_ + (took_ns > lead_ns_ ? 4 * kStep_ns : -kStep_ns), 0, longest_ns_);
}

}  // namespace takt
