// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/append_log.hpp>: core, experimental.
#pragma once
#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <type_traits>

namespace takt {

/// Rare events of a run, in shared memory: any thread of any process appends without waiting for another, anybody reads
/// at any time. Keeps the first kMost and counts the rest. T is trivially copyable.
template <class T, size_t kMost>
class AppendLog {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  /// False if it is full: the event is only counted.
  bool append(const T& event) {
    const uint64_t place = taken_.fetch_add(1, std::memory_order_acq_rel);
    if (place >= kMost) return false;
    entries_[place].event = event;
    entries_[place].complete.store(true, std::memory_order_release);
    return true;
  }
  size_t size() const { return static_cast<size_t>(std::min<uint64_t>(taken_.load(std::memory_order_acquire), kMost)); }
  uint64_t lost() const {
    const uint64_t taken = taken_.load(std::memory_order_acquire);
    return taken > kMost ? taken - kMost : 0;
  }
  /// Null while it is being written (or for ever, if its writer died at it).
  const T* at(size_t place) const {
    return entries_[place].complete.load(std::memory_order_acquire) ? &entries_[place].event : nullptr;
  }

 private:
  struct Entry {
    std::atomic<bool> complete{false};
    T event{};
  };
  std::atomic<uint64_t> taken_{0};
  std::array<Entry, kMost> entries_{};
};

/// Text of bounded length, ended by 0; a longer one is cut.
template <size_t kBytes>
struct BoundedText {
  std::array<char, kBytes> characters{};
  BoundedText() = default;
  explicit BoundedText(std::string_view text) {
    std::memcpy(characters.data(), text.data(), std::min(text.size(), kBytes - 1));
  }
  /// Up to the end of the characters, whatever stands there.
  std::string_view text() const { return {characters.data(), strnlen(characters.data(), kBytes)}; }
};

}  // namespace takt
