// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <atomic>
#include <cstddef>

#include "rt/trace/event.hpp"

namespace takt::trace {

/// Bounded queue from one writing thread to one reading thread, which may live in another process: no pointer inside,
/// no lock, no system call. The writer never waits: an event that finds the ring full is lost and counted. (A circular
/// buffer whose two indexes only grow: L. Lamport, Proving the Correctness of Multiprocess Programs, 1977.)
class Ring {
 public:
  static constexpr size_t kEvents = 4096;  ///< 128 KiB: 200 ms of a lane that does 1,000 jobs a second

  /// Writer only.
  void push(const Event& event) {
    const uint64_t head = head_.load(std::memory_order_relaxed);
    // The reader's index is looked at only when the ring seems full: its cache line stays with the reader.
    if (head - tail_seen_ == kEvents) {
      tail_seen_ = tail_.load(std::memory_order_acquire);
      if (head - tail_seen_ == kEvents) {
        lost_.store(lost_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
        return;
      }
    }
    events_[head % kEvents] = event;
    head_.store(head + 1, std::memory_order_release);
  }

  /// Reader only: hands all events written so far to `take(const Event&)`, oldest first.
  template <class Take>
  void drain(Take&& take) {
    const uint64_t head = head_.load(std::memory_order_acquire);
    uint64_t tail = tail_.load(std::memory_order_relaxed);
    for (; tail < head; ++tail) take(events_[tail % kEvents]);
    tail_.store(tail, std::memory_order_release);
  }

  /// Events that found no room. Any thread.
  uint64_t lost() const { return lost_.load(std::memory_order_relaxed); }

  // Who writes: set once by Rings::claim, before `writer` is.
  std::array<char, 16> name{};     ///< of the thread, ended by 0
  std::atomic<int32_t> writer{0};  ///< thread id, 0: nobody yet

 private:
  alignas(64) std::atomic<uint64_t> head_{0};
  uint64_t tail_seen_ = 0;
  std::atomic<uint64_t> lost_{0};
  alignas(64) std::atomic<uint64_t> tail_{0};
  alignas(64) std::array<Event, kEvents> events_{};
};

}  // namespace takt::trace
