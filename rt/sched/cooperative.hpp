// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>
#include <mutex>
#include <vector>

#include "rt/sched/anticipation.hpp"
#include "rt/sched/lane.hpp"

namespace takt {

/// Non-preemptive earliest-deadline-first over any number of ordinary threads: each calls work(). A lane runs on one
/// thread at a time. For each release that comes one thread sleeps, not all for the same: two that woke together would
/// delay each other at the lock. Needs no privilege.
class CooperativeQueue {
 public:
  CooperativeQueue(const std::vector<std::unique_ptr<Lane>>& lanes, const Clock& clock, StopSignal& stop,
                   int64_t longest_lead_ns)
      : clock_(clock), stop_(stop), longest_lead_ns_(longest_lead_ns) {
    for (const auto& lane : lanes) entries_.push_back({lane.get(), false});
    wakes_.reserve(lanes.size() + 1);
    releases_.reserve(lanes.size());
  }
  /// Runs lanes until none has a release before the end.
  void work();

 private:
  struct Entry {
    Lane* lane;
    bool busy;
  };
  Entry* earliest_deadline(int64_t now_ns);
  int64_t next_release_ns() const;
  /// First release for which no sleeping thread wakes in time; the end if there is none.
  int64_t next_uncovered_release_ns();
  /// The lane that rests until then; null if there is none.
  Entry* released_at(int64_t instant_ns);
  void sleep(std::unique_lock<std::mutex>& lock, int64_t until_ns, Anticipation& anticipation);
  /// The rest of the way to that release, awake, with a lane that is then to run.
  void stay_awake(std::unique_lock<std::mutex>& lock, int64_t until_ns, Anticipation& anticipation);

  const Clock& clock_;
  StopSignal& stop_;
  const int64_t longest_lead_ns_;
  std::mutex mutex_;
  std::vector<Entry> entries_;
  std::vector<int64_t> wakes_, releases_;  ///< of the sleeping threads; scratch
};

}  // namespace takt
