// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

namespace takt::record {

struct Unmap {
  size_t bytes = 0;
  void operator()(std::byte* memory) const;
};
/// Memory straight from the kernel.
using OwnPages = std::unique_ptr<std::byte, Unmap>;

/// What waits to be written, bounded by its bytes: who finds no room goes on without. One thread pushes, one pops.
/// Large messages behind a slow disk wait in pages of their own, which the kernel has back afterwards: a heap keeps all
/// it ever had, and does not find all of it again once other threads freed it.
class WriteQueue {
 public:
  struct Entry {
    uint16_t channel = 0;
    uint64_t sequence = 0;
    int64_t at_ns = 0;
    std::vector<std::byte> data;  ///< empty if it waited
    OwnPages waited = {};         ///< all of it, if it waited

    std::span<const std::byte> bytes() const {
      return waited ? std::span<const std::byte>(waited.get(), waited.get_deleter().bytes) : data;
    }
  };

  explicit WriteQueue(size_t most_bytes) : most_bytes_(most_bytes) {}

  /// A buffer to fill, empty, with the memory of an earlier one where there is one for so many bytes: large enough, and
  /// not much larger, or small messages would sooner or later hold the memory of images.
  std::vector<std::byte> buffer(size_t expected_bytes);
  /// False if there is no room: the entry is lost. With `wait` there always is, sooner or later. Any thread.
  bool push(Entry entry, bool wait);
  /// The oldest entry; waits for one. Nothing once the queue was closed and is empty.
  std::optional<Entry> pop();
  /// Gives the memory of a popped entry back; kept up to kSpareBytes in all.
  void recycle(std::vector<std::byte> buffer);
  void close();

  static constexpr size_t kSpareBytes = 16 << 20;
  /// Waits in pages of its own if it is as large and more than kSpareBytes wait with it; smaller ones would waste most
  /// of a page. Not in virtual time, where the pusher waits for room.
  static constexpr size_t kLarge = 64 << 10;

 private:
  bool behind(size_t bytes);
  static constexpr size_t kBuffersKept = 64;
  const size_t most_bytes_;
  std::mutex mutex_;
  std::condition_variable filled_, emptied_;
  std::deque<Entry> entries_;
  std::vector<std::vector<std::byte>> spare_;
  size_t bytes_ = 0, spare_bytes_ = 0;
  bool closed_ = false;
};

}  // namespace takt::record
