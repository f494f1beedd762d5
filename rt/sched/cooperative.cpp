// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/cooperative.hpp"

#include <algorithm>
#include <chrono>
#include <limits>

namespace takt {

CooperativeQueue::Entry* CooperativeQueue::earliest_deadline(int64_t now_ns) {
  Entry* best = nullptr;
  const int64_t end = stop_.end_ns();
  for (Entry& entry : entries_) {
    if (entry.busy) continue;  // a busy lane belongs to the worker that runs it, reading it would race
    const int64_t release = entry.lane->next_release_ns();
    if (release > now_ns || release >= end) continue;
    if (best == nullptr || entry.lane->next_deadline_ns() < best->lane->next_deadline_ns()) best = &entry;
  }
  return best;
}

int64_t CooperativeQueue::next_release_ns() const {
  int64_t next = std::numeric_limits<int64_t>::max();
  for (const Entry& entry : entries_) {
    if (!entry.busy) next = std::min(next, entry.lane->next_release_ns());
  }
  return next;
}

void CooperativeQueue::sleep(std::unique_lock<std::mutex>& lock, int64_t until_ns) {
  // steady_clock is CLOCK_MONOTONIC here, the runtime's own clock.
  changed_.wait_until(lock, std::chrono::steady_clock::time_point(std::chrono::nanoseconds(until_ns)));
}

void CooperativeQueue::work() {
  std::unique_lock lock(mutex_);
  while (true) {
    if (Entry* entry = earliest_deadline(clock_.now_ns())) {
      entry->busy = true;
      lock.unlock();
      entry->lane->watch().bind(Reservation{});
      entry->lane->run_next(clock_, stop_);
      lock.lock();
      entry->busy = false;
      changed_.notify_all();
      continue;
    }
    const int64_t next = next_release_ns();
    // What a busy lane has still to do is done by the worker that is at it: nobody need wait for a job that may never
    // return.
    if (next >= stop_.end_ns()) return changed_.notify_all();
    sleep(lock, next);
  }
}

void CooperativeQueue::wake() {
  const std::lock_guard lock(mutex_);
  changed_.notify_all();
}

}  // namespace takt
