// SPDX-License-Identifier: Apache-2.0
// What became of processes that were away: plain data in the memory that the processes of a run share, so that it is
// there even if the process that noted it is not.
#pragma once
#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "rt/sched/append_log.hpp"

namespace takt {

/// A process of a run that was away.
struct Outage {
  uint32_t process = 0;
  uint32_t freed = 0;    ///< chunks that the dead process had held
  int64_t from_ns = 0;   ///< seen to have ended; of one that hung: since when it did
  int64_t start_ns = 0;  ///< when it is, or was, started again; 0: it is given up
  int64_t back_ns = 0;   ///< every task of it with a rate has run a job again; 0: not yet
  bool started = false;
  bool by_spare = false;  ///< a spare has taken its place
  /// When its successor had composed its part, had joined the others, and ran; 0: it never did.
  int64_t composed_ns = 0, joined_ns = 0, running_ns = 0;
  BoundedText<200> cause;  ///< "was ended by signal 9 (Killed)"
};

/// The newest ones, and those that last. One writer.
class OutageLog {
 public:
  static constexpr size_t kMost = 512;
  size_t size() const { return count_.load(std::memory_order_acquire); }
  Outage& operator[](size_t i) { return outages_[i]; }
  const Outage& operator[](size_t i) const { return outages_[i]; }
  /// Its place, where it stays while it lasts. When the log is full, it takes that of the oldest one that is over.
  size_t add(const Outage& outage) {
    const size_t count = size();
    if (count < kMost) {
      outages_[count] = outage;
      count_.store(count + 1, std::memory_order_release);
      return count;
    }
    const auto oldest = std::min_element(outages_.begin(), outages_.end(), [](const Outage& a, const Outage& b) {
      return std::pair(a.back_ns == 0, a.from_ns) < std::pair(b.back_ns == 0, b.from_ns);
    });
    *oldest = outage;
    lost_.fetch_add(1);
    return static_cast<size_t>(oldest - outages_.begin());
  }
  /// In the order of their beginnings.
  std::vector<Outage> in_order() const {
    std::vector<Outage> all(outages_.begin(), outages_.begin() + static_cast<std::ptrdiff_t>(size()));
    std::stable_sort(all.begin(), all.end(), [](const Outage& a, const Outage& b) { return a.from_ns < b.from_ns; });
    return all;
  }
  /// Outages that are no longer in it.
  uint64_t lost() const { return lost_.load(); }

 private:
  std::atomic<size_t> count_{0};
  std::atomic<uint64_t> lost_{0};
  std::array<Outage, kMost> outages_{};
};

/// What a group of processes, a supervisor with its members, and the one who keeps it show to each other.
struct GroupSigns {
  struct Loss {
    int64_t from_ns = 0;
    BoundedText<200> cause;
  };
  std::atomic<int64_t> heartbeat_ns{0};  ///< when the daemon of its transport last answered; 0: no answer is expected
  std::atomic<bool> ordinary{true};      ///< its threads have no real-time policy (yet), and may be kept waiting
  Loss newest_loss;                      ///< written by the keeper, while there is no group
  std::atomic<uint64_t> losses{0};       ///< groups that were lost
};

}  // namespace takt
