// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <condition_variable>
#include <cstddef>
#include <mutex>

namespace takt {

/// A meeting point of a fixed number of threads, once. std::barrier will not do: it spins with sched_yield, which under
/// SCHED_DEADLINE gives the whole budget away until the next replenishment (measured: first releases up to 420 ms
/// late).
class Rendezvous {
 public:
  explicit Rendezvous(size_t threads) : missing_(threads) {}
  void arrive_and_wait() {
    std::unique_lock lock(mutex_);
    if (--missing_ == 0) return complete_.notify_all();
    complete_.wait(lock, [this] { return missing_ == 0; });
  }

  /// So many of them will never come.
  void leave(size_t threads) {
    const std::lock_guard lock(mutex_);
    missing_ -= threads;
    if (missing_ == 0) complete_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable complete_;
  size_t missing_;
};

}  // namespace takt
