// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/cooperative.hpp"

#include <algorithm>
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

int64_t CooperativeQueue::next_uncovered_release_ns() {
  releases_.clear();
  for (const Entry& entry : entries_)
    if (!entry.busy) releases_.push_back(entry.lane->next_release_ns());
  std::sort(releases_.begin(), releases_.end());
  const int64_t end = stop_.end_ns();
  for (size_t i = 0; i < releases_.size() && releases_[i] < end; ++i) {
    const auto in_time = std::count_if(wakes_.begin(), wakes_.end(), [&](int64_t at) { return at <= releases_[i]; });
    if (static_cast<size_t>(in_time) <= i) return releases_[i];
  }
  return end;
}

void CooperativeQueue::sleep(std::unique_lock<std::mutex>& lock, int64_t until_ns, Anticipation& anticipation) {
  wakes_.push_back(until_ns);
  const Entry* awaited = released_at(until_ns);
  lock.unlock();
  // Nobody need be woken: who finishes a lane sleeps for its next release himself.
  const bool early = anticipation.sleep_before(until_ns, clock_, stop_);
  if (!early && awaited != nullptr) awaited->lane->fetch_ahead();
  lock.lock();
  wakes_.erase(std::find(wakes_.begin(), wakes_.end(), until_ns));
  if (early) stay_awake(lock, until_ns, anticipation);
}

CooperativeQueue::Entry* CooperativeQueue::released_at(int64_t instant_ns) {
  for (Entry& entry : entries_)
    if (!entry.busy && entry.lane->next_release_ns() == instant_ns) return &entry;
  return nullptr;
}

void CooperativeQueue::stay_awake(std::unique_lock<std::mutex>& lock, int64_t until_ns, Anticipation& anticipation) {
  Entry* next = released_at(until_ns);
  if (next == nullptr) return;  // the end of the run
  next->busy = true;            // nobody else runs it before its release anyway
  lock.unlock();
  next->lane->rehearse();
  anticipation.stay_awake_until(until_ns, clock_);
  lock.lock();
  next->busy = false;
}

void CooperativeQueue::work() {
  Anticipation anticipation(longest_lead_ns_, Anticipation::Beside::everybody);
  std::unique_lock lock(mutex_);
  while (true) {
    if (Entry* entry = earliest_deadline(clock_.now_ns())) {
      entry->busy = true;
      lock.unlock();
      entry->lane->watch().bind(Reservation{});
      entry->lane->run_next(clock_, stop_);
      lock.lock();
      entry->busy = false;
      continue;
    }
    // What a busy lane has still to do is done by the worker that is at it: nobody need wait for a job that may never
    // return.
    if (next_release_ns() >= stop_.end_ns()) return;
    sleep(lock, next_uncovered_release_ns(), anticipation);
  }
}

}  // namespace takt
