// SPDX-License-Identifier: Apache-2.0
// Many lists of numbers that grow and shrink inside one array that is taken once: each lies in one piece and ascends,
// so that reading one is reading memory, and nothing allocates while a job runs.
#pragma once
#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "rt/state_archive.hpp"

namespace takt::semantic {

/// Slices of powers of two; those given back serve others of their size or, halved, smaller ones. Growth alone leaves
/// at least a quarter of the array filled when it is used up. One thread at a time.
class Slices {
 public:
  struct Slice {
    uint32_t first = 0, size = 0;
    uint8_t order = kEmpty;  ///< room for 2^order items
  };

  explicit Slices(size_t items);

  /// In its place; nothing if it is there already. False: the array is used up, and nothing has changed.
  bool insert(Slice& slice, uint32_t item);
  void erase(Slice& slice, uint32_t item);
  void release(Slice& slice);
  std::span<const uint32_t> items(const Slice& slice) const { return {items_.data() + slice.first, slice.size}; }
  /// What of the array was given out so far.
  void remember(StateArchive& archive);

 private:
  static constexpr uint8_t kEmpty = 255, kSmallest = 2, kOrders = 31;
  static constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();
  uint32_t take(uint8_t order);  ///< first item, or kNone
  void give_back(uint32_t first, uint8_t order);

  std::vector<uint32_t> items_;
  std::array<uint32_t, kOrders> free_;  ///< by order: first free slice, whose first item names the next
  uint32_t used_ = 0;
};

}  // namespace takt::semantic
