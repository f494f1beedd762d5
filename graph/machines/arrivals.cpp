// SPDX-License-Identifier: Apache-2.0
#include "graph/machines/arrivals.hpp"

namespace takt::machines {

Arrivals::Verdict Arrivals::take(uint64_t sequence) {
  if (newest_ == 0) {
    newest_ = first_ = sequence;
    seen_ = 1;
    ++expected_, ++received_;
    return fresh;
  }
  if (sequence > newest_) {
    const uint64_t ahead = sequence - newest_;
    seen_ = ahead < kWindow ? seen_ << ahead | 1 : 1;
    newest_ = sequence;
    expected_ += ahead, ++received_;
    return fresh;
  }
  const uint64_t behind = newest_ - sequence;
  if (sequence < first_ || behind >= kWindow || (seen_ >> behind & 1) != 0) {
    ++doubles_;
    return doubled;
  }
  seen_ |= uint64_t{1} << behind;
  ++received_, ++passes_;
  return passed;
}

}  // namespace takt::machines
