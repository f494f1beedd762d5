// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <atomic>
#include <cstdint>
#include <optional>

namespace takt::sim {

/// A state variable has this value from then on. Values are numbers of States.
struct Change {
  int64_t at_ns = 0;
  int32_t value = 0;
};

/// The changes of one state variable by one writer, in the order of their instants; any thread reads without a lock.
/// The newest kSlots - 1 are kept; who asks for older ones gets the oldest.
class Track {
 public:
  static constexpr uint64_t kSlots = 64;

  /// Not before the change before it.
  void append(const Change& change) {
    const uint64_t count = count_.load(std::memory_order_relaxed);
    Slot& slot = slots_[count % kSlots];
    slot.at_ns.store(change.at_ns, std::memory_order_relaxed);
    slot.value.store(change.value, std::memory_order_relaxed);
    count_.store(count + 1, std::memory_order_release);
  }
  /// The newest change at or before an instant; nothing: there was none yet.
  std::optional<Change> newest(int64_t at_ns) const {
    const uint64_t count = count_.load(std::memory_order_acquire);
    const uint64_t oldest = count < kSlots ? 0 : count - kSlots + 1;  // the slot after the newest may be written now
    for (uint64_t i = count; i-- > oldest;) {
      const Slot& slot = slots_[i % kSlots];
      const Change change{slot.at_ns.load(std::memory_order_relaxed), slot.value.load(std::memory_order_relaxed)};
      if (change.at_ns <= at_ns || (i == oldest && oldest > 0)) return change;
    }
    return std::nullopt;
  }

 private:
  struct Slot {
    std::atomic<int64_t> at_ns{0};
    std::atomic<int32_t> value{0};
  };
  std::array<Slot, kSlots> slots_;
  std::atomic<uint64_t> count_{0};
};

}  // namespace takt::sim
