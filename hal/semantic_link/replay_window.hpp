// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <bitset>
#include <cstdint>

namespace takt::semantic_link {

/// Which datagrams of a session have come: each sequence number is taken once (the sliding window of RFC 4303, 3.4.3).
class ReplayWindow {
 public:
  static constexpr uint32_t kWidth = 1024;  ///< one that is so much older than the newest counts as seen

  /// False if that one has come before, or is too old to tell.
  bool take(uint32_t sequence) {
    if (sequence > newest_) {
      const uint32_t step = sequence - newest_;
      if (step >= kWidth) seen_.reset();
      else
        for (uint32_t i = 1; i < step; ++i) seen_.reset((newest_ + i) % kWidth);
      missing_ += step - 1;
      newest_ = sequence;
      seen_.set(sequence % kWidth);
      return true;
    }
    if (newest_ - sequence >= kWidth || sequence == 0 || seen_.test(sequence % kWidth)) return false;
    seen_.set(sequence % kWidth);
    --missing_;
    return true;
  }
  /// Of those up to the newest, how many have not come.
  uint64_t missing() const { return missing_; }

 private:
  std::bitset<kWidth> seen_;
  uint32_t newest_ = 0;
  uint64_t missing_ = 0;
};

}  // namespace takt::semantic_link
