// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <atomic>
#include <cstdint>

#include "rt/hot.hpp"

namespace takt {

/// Wakes who waits for messages of a run and is no job of it, in any of its processes. Plain data, for shared memory.
///
///   bell.ring();                                              // a job has published
///   for (uint32_t heard;; bell.wait(heard, 100'000'000)) {    // another thread or process
///     heard = bell.rung();
///     take_what_is_there();                                   // what comes from here on ends the wait at once
///   }
///
/// Any thread rings and waits. ring() is one system call and waits for nobody.
class alignas(kCacheLine) Doorbell {
 public:
  void ring();
  uint32_t rung() const { return rung_.load(std::memory_order_acquire); }
  /// Until it has rung after `heard`, or so long. May come back early.
  void wait(uint32_t heard, int64_t at_most_ns) const;

 private:
  std::atomic<uint32_t> rung_{0};
};

}  // namespace takt
