// SPDX-License-Identifier: Apache-2.0
// A doorbell: a word that is counted up and slept on. Works across processes that share the memory.
#pragma once
#include <linux/futex.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <ctime>

namespace takt::bench {

/// Sleeps while `word` is `value`, at most `timeout_ns` (negative: without end). May return early.
inline void wait_while(const std::atomic<uint32_t>& word, uint32_t value, int64_t timeout_ns = -1) {
  const timespec timeout{timeout_ns / 1'000'000'000, timeout_ns % 1'000'000'000};
  syscall(SYS_futex, &word, FUTEX_WAIT, value, timeout_ns < 0 ? nullptr : &timeout, nullptr, 0);
}
inline void wake(std::atomic<uint32_t>& word) {
  word.fetch_add(1, std::memory_order_release);
  syscall(SYS_futex, &word, FUTEX_WAKE, 1, nullptr, nullptr, 0);
}

/// One sleeper's view of a doorbell.
class Bell {
 public:
  explicit Bell(const std::atomic<uint32_t>& word) : word_(&word), seen_(word.load()) {}
  /// True if it rang since the last call that returned true; false after `timeout_ns` of silence.
  bool wait(int64_t timeout_ns) {
    if (word_->load(std::memory_order_acquire) == seen_) wait_while(*word_, seen_, timeout_ns);
    const uint32_t now = word_->load(std::memory_order_acquire);
    if (now == seen_) return false;
    seen_ = now;
    return true;
  }

 private:
  const std::atomic<uint32_t>* word_;
  uint32_t seen_;
};

}  // namespace takt::bench
