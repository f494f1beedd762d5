// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <limits>
#include <tuple>
#include <utility>
#include <vector>

#include "rt/state_archive.hpp"

namespace takt::navigation {

/// Numbers 0..n-1, each at most once, least key first; of equal keys the least number. A key may fall while its number
/// is in the heap. Memory is taken by the constructor.
template <class Key>
class IndexedHeap {
 public:
  explicit IndexedHeap(size_t n) : place_(n, kOut) { heap_.reserve(n); }

  void clear() {
    for (const Entry& entry : heap_) place_[entry.number] = kOut;
    heap_.clear();
  }
  bool empty() const { return heap_.empty(); }
  const Key& least() const { return heap_.front().key; }

  /// Puts it in, or lowers its key; a higher key changes nothing.
  void put(uint32_t number, const Key& key) {
    if (place_[number] == kOut) {
      place_[number] = static_cast<uint32_t>(heap_.size());
      heap_.push_back({key, number});
    } else if (key < heap_[place_[number]].key) {
      heap_[place_[number]].key = key;
    } else {
      return;
    }
    rise(place_[number]);
  }

  uint32_t take_least() {
    const uint32_t number = heap_.front().number;
    place_[number] = kOut;
    const Entry last = heap_.back();
    heap_.pop_back();
    if (!heap_.empty()) {
      set(0, last);
      sink(0);
    }
    return number;
  }

  void remember(StateArchive& archive) {
    if (archive.loads()) clear();
    TAKT_STATE(archive, heap_);
    for (size_t at = 0; at < heap_.size() && archive.loads() && !archive.failed(); ++at) {
      if (heap_[at].number >= place_.size()) return archive.fail();
      place_[heap_[at].number] = static_cast<uint32_t>(at);
    }
  }

 private:
  struct Entry {
    Key key;
    uint32_t number;
    void remember(StateArchive& archive) { TAKT_STATE(archive, key, number); }
    bool operator<(const Entry& other) const { return std::tie(key, number) < std::tie(other.key, other.number); }
  };
  static constexpr uint32_t kOut = std::numeric_limits<uint32_t>::max();

  void set(size_t at, const Entry& entry) {
    heap_[at] = entry;
    place_[entry.number] = static_cast<uint32_t>(at);
  }
  void exchange(size_t a, size_t b) {
    const Entry entry = heap_[a];
    set(a, heap_[b]);
    set(b, entry);
  }
  void rise(size_t at) {
    for (; at > 0 && heap_[at] < heap_[(at - 1) / 2]; at = (at - 1) / 2) exchange(at, (at - 1) / 2);
  }
  void sink(size_t at) {
    for (size_t child; (child = 2 * at + 1) < heap_.size(); at = child) {
      if (child + 1 < heap_.size() && heap_[child + 1] < heap_[child]) ++child;
      if (!(heap_[child] < heap_[at])) return;
      exchange(at, child);
    }
  }

  std::vector<Entry> heap_;
  std::vector<uint32_t> place_;  ///< by number
};

}  // namespace takt::navigation
