// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/time/clock.hpp>: core, stable.
#pragma once
#include <atomic>
#include <cstdint>

namespace takt {

/// The one source of time. Every stamp, release and deadline is in nanoseconds of this clock; tests inject a
/// VirtualClock. Thread-safe.
class Clock {
 public:
  virtual ~Clock() = default;
  virtual int64_t now_ns() const = 0;
  virtual bool is_virtual() const = 0;
};

/// CLOCK_MONOTONIC.
class MonotonicClock final : public Clock {
 public:
  int64_t now_ns() const override;
  bool is_virtual() const override { return false; }
};

/// Time that moves only when told to, never backwards.
class VirtualClock final : public Clock {
 public:
  explicit VirtualClock(int64_t start_ns = 0) : now_(start_ns) {}
  int64_t now_ns() const override { return now_.load(std::memory_order_acquire); }
  bool is_virtual() const override { return true; }
  void advance_to(int64_t ns) {
    if (ns > now_ns()) now_.store(ns, std::memory_order_release);
  }

 private:
  std::atomic<int64_t> now_;
};

/// CPU time the calling thread has used, ns.
int64_t thread_cpu_ns();

}  // namespace takt
