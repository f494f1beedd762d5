// SPDX-License-Identifier: Apache-2.0
#include "nodes/semantic/slices.hpp"

#include <algorithm>

namespace takt::semantic {

Slices::Slices(size_t items) : items_(items) { free_.fill(kNone); }

bool Slices::insert(Slice& slice, uint32_t item) {
  const auto old = items(slice);
  const auto at = static_cast<uint32_t>(std::lower_bound(old.begin(), old.end(), item) - old.begin());
  if (at < slice.size && old[at] == item) return true;
  if (slice.order == kEmpty || slice.size == uint32_t{1} << slice.order) {
    const uint8_t order = slice.order == kEmpty ? kSmallest : static_cast<uint8_t>(slice.order + 1);
    const uint32_t first = take(order);
    if (first == kNone) return false;
    std::copy(old.begin(), old.end(), items_.begin() + first);
    if (slice.order != kEmpty) give_back(slice.first, slice.order);
    slice.first = first;
    slice.order = order;
  }
  const auto begin = items_.begin() + slice.first;
  std::copy_backward(begin + at, begin + slice.size, begin + slice.size + 1);
  begin[at] = item;
  ++slice.size;
  return true;
}

void Slices::erase(Slice& slice, uint32_t item) {
  const auto begin = items_.begin() + slice.first, end = begin + slice.size;
  const auto at = std::lower_bound(begin, end, item);
  if (at == end || *at != item) return;
  std::copy(at + 1, end, at);
  if (--slice.size == 0) release(slice);
}

void Slices::release(Slice& slice) {
  if (slice.order != kEmpty) give_back(slice.first, slice.order);
  slice = {};
}

void Slices::remember(StateArchive& archive) {
  TAKT_STATE(archive, used_, free_);
  archive.room(items_.size() * sizeof(uint32_t));
  if (used_ > items_.size()) return archive.fail();
  archive.raw(items_.data(), used_ * sizeof(uint32_t));
}

uint32_t Slices::take(uint8_t order) {
  if (order >= kOrders) return kNone;
  if (const uint32_t first = free_[order]; first != kNone) {
    free_[order] = items_[first];
    return first;
  }
  const uint32_t length = uint32_t{1} << order;
  if (items_.size() - used_ >= length) {
    used_ += length;
    return used_ - length;
  }
  const uint32_t twice = take(static_cast<uint8_t>(order + 1));
  if (twice != kNone) give_back(twice + length, order);
  return twice;
}

void Slices::give_back(uint32_t first, uint8_t order) {
  items_[first] = free_[order];
  free_[order] = first;
}

}  // namespace takt::semantic
