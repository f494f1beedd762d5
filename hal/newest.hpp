// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/hal/newest.hpp>: hal, experimental.
#pragma once
#include <array>
#include <atomic>
#include <cstdint>

namespace takt {

/// Hands the newest of what one thread writes to one other thread; neither ever waits for the other. Of the three
/// slots each thread owns one, the third lies between them.
template <class T>
class Newest {
 public:
  /// All slots, before the threads begin.
  template <class Function>
  void for_each(Function&& function) {
    for (T& slot : slots_) function(slot);
  }
  /// The writer's own slot.
  T& draft() { return slots_[writers_]; }
  void publish() { writers_ = between_.exchange(writers_ | kNew, std::memory_order_acq_rel) & kSlot; }
  /// What was published last, the reader's until it takes the next; null if it has taken that already.
  const T* take() {
    if ((between_.load(std::memory_order_relaxed) & kNew) == 0) return nullptr;
    readers_ = between_.exchange(readers_, std::memory_order_acq_rel) & kSlot;
    return &slots_[readers_];
  }

 private:
  static constexpr uint32_t kSlot = 3, kNew = 4;
  std::array<T, 3> slots_{};
  uint32_t writers_ = 0, readers_ = 1;
  std::atomic<uint32_t> between_{2};
};

}  // namespace takt
