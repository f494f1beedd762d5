// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <memory>

namespace takt::sim {

/// States of a commanded mechanism at fixed ticks. One thread appends; any thread reads without a lock. The newest
/// `kSlots` ticks (164 s) are kept; who asks for older ones gets the oldest.
template <size_t N>
class History {
 public:
  static constexpr int64_t kTickNs = 10'000'000;
  static constexpr int64_t kSlots = 16384;
  using State = std::array<double, N>;

  explicit History(const State& start) : slots_(std::make_unique<Slot[]>(kSlots)) { restart(start); }

  /// Not concurrently with readers.
  void restart(const State& start) {
    count_.store(0, std::memory_order_relaxed);
    append(start);
  }
  void append(const State& state) {
    const int64_t tick = count_.load(std::memory_order_relaxed);
    write(tick, state);
    count_.store(tick + 1, std::memory_order_release);
  }
  /// The newest state once more for every tick up to that one, at the cost of at most kSlots of them. Appender only,
  /// and only while all states kept are the same: readers may still look at the slots that are written.
  void stay_until(int64_t tick) {
    const State state = at_tick(last_tick());
    const int64_t first = count_.load(std::memory_order_relaxed);
    if (tick < first) return;
    for (int64_t t = std::max(first, tick + 1 - kSlots); t <= tick; ++t) write(t, state);
    count_.store(tick + 1, std::memory_order_release);
  }
  int64_t last_tick() const { return count_.load(std::memory_order_acquire) - 1; }
  State at_tick(int64_t tick) const {
    const int64_t last = last_tick();
    const int64_t oldest = last - kSlots + 2 > 0 ? last - kSlots + 2 : 0;
    const int64_t wanted = tick < oldest ? oldest : tick > last ? last : tick;
    State state;
    for (size_t i = 0; i < N; ++i)
      state[i] = slots_[static_cast<size_t>(wanted % kSlots)][i].load(std::memory_order_relaxed);
    return state;
  }

 private:
  void write(int64_t tick, const State& state) {
    Slot& slot = slots_[static_cast<size_t>(tick % kSlots)];
    for (size_t i = 0; i < N; ++i) slot[i].store(state[i], std::memory_order_relaxed);
  }

  using Slot = std::array<std::atomic<double>, N>;
  std::unique_ptr<Slot[]> slots_;
  std::atomic<int64_t> count_{0};
};

}  // namespace takt::sim
