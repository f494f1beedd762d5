// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <utility>

#include "rt/node.hpp"
#include "rt/shm/transport.hpp"

namespace takt {

/// Reads every message of an output once, in order and as soon as it is published, beside the consumers of the output
/// and holding one at a time. One thread at a time.
class Follower {
 public:
  explicit Follower(std::unique_ptr<Reader> reader) : reader_(std::move(reader)) {}

  /// visit(const Held&) for each message published since the last call. Returns how many were gone before they could
  /// be read.
  template <class Visit>
  uint64_t take(const Visit& visit) {
    std::array<Candidate, InputPort::kMaxDepth> candidates;
    size_t fresh = reader_->list(std::numeric_limits<int64_t>::max(), candidates);
    while (fresh > 0 && candidates[fresh - 1].sequence <= seen_) --fresh;  // the oldest stand last
    uint64_t gone = 0;
    for (size_t i = fresh; i-- > 0;) {
      const uint64_t sequence = candidates[i].sequence;
      if (sequence <= seen_) continue;
      gone += sequence - seen_ - 1;
      seen_ = sequence;
      Held held = reader_->take(sequence);
      if (!held) {
        ++gone;
        continue;
      }
      visit(std::as_const(held));
      reader_->release(held);
    }
    return gone;
  }
  /// visit(const Held&) for the newest message, if it is one that take() came to.
  template <class Visit>
  void again(const Visit& visit) {
    Candidate newest;
    if (seen_ == 0 || reader_->list(std::numeric_limits<int64_t>::max(), std::span(&newest, 1)) == 0) return;
    if (newest.sequence > seen_) return;
    if (Held held = reader_->take(newest.sequence)) {
      visit(std::as_const(held));
      reader_->release(held);
    }
  }
  /// Sequence of the newest message that it came to; 0: none yet.
  uint64_t seen() const { return seen_; }

 private:
  std::unique_ptr<Reader> reader_;
  uint64_t seen_ = 0;
};

}  // namespace takt
