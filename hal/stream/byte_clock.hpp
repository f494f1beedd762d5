// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>

#include "hal/stream/byte_stream.hpp"

namespace takt {

/// When a byte of a line came, although bytes are read in chunks and late. A byte cannot have come later than a chunk
/// that holds it was read; and of a chunk that was read at t the byte before the last came a byte time before t at the
/// latest, and so on back to any byte before it. The earliest of these bounds is the estimate: adapters and schedulers
/// only ever delay. Of bytes that lie 64 chunks back the estimate is late.
class ByteClock {
 public:
  void set_baud(uint32_t baud) { byte_ns_ = byte_time_ns(baud); }
  /// All bytes before position `end` have been read by `at_ns`.
  void add(uint64_t end, int64_t at_ns) { chunks_[next_++ % chunks_.size()] = {end, at_ns}; }
  int64_t byte_ns() const { return byte_ns_; }
  /// When the last bit of the byte at that position came; the byte lies before the last `end`.
  int64_t arrival_ns(uint64_t position) const {
    int64_t earliest = INT64_MAX;
    for (size_t i = 0; i < std::min<uint64_t>(next_, chunks_.size()); ++i)
      if (chunks_[i].end > position)
        earliest =
            std::min(earliest, chunks_[i].at_ns - static_cast<int64_t>(chunks_[i].end - 1 - position) * byte_ns_);
    return earliest;
  }

 private:
  struct Chunk {
    uint64_t end = 0;
    int64_t at_ns = 0;
  };
  std::array<Chunk, 64> chunks_{};
  uint64_t next_ = 0;
  int64_t byte_ns_ = 0;
};

/// Instants of what happens at whole multiples of a period, from sightings that may be late but never early: an earlier
/// sighting is nearer to the truth than what the ones before let expect, a later one is not. The expectation moves
/// later by kLeak of the time that passes, so that it follows a device whose period is up to that much longer than it
/// should be (a recorded LMS 200 turns 0.14 % slower than its manual says).
class PeriodicInstants {
 public:
  explicit PeriodicInstants(int64_t period_ns) : period_ns_(period_ns) {}
  void reset() {
    known_ = false;
    too_many_ = 0;
  }
  /// The instant that was seen at `seen_ns`, not after it; sets periods().
  int64_t refine(int64_t seen_ns) {
    periods_ = 1;
    int64_t expected = seen_ns;
    if (known_) {
      // Late by up to three quarters of a period; one that is seen later counts as the next one.
      const int64_t since_ns = seen_ns - last_ns_;
      periods_ = (since_ns + period_ns_ / 4) / period_ns_;
      // Too near to the one before: that was the first, which may be as late as it likes, or it was counted too far.
      if (periods_ <= 0) periods_ = too_many_ > 0 ? 0 : 1;
      too_many_ += periods_ - 1;
      if (periods_ > 0) expected = last_ns_ + periods_ * period_ns_ + periods_ * period_ns_ / kLeak;
      // Late itself, then; later ones must not be taken for it.
      else if (since_ns > period_ns_ / 4) expected = last_ns_ + period_ns_ / 20;
    }
    known_ = true;
    return last_ns_ = std::min(seen_ns, expected);
  }
  /// From the instant before to this one: 1, more where some were not seen, 0 where the one before had been seen so
  /// late that one too many was counted. In sum they are right once an instant has been seen in time; where many of
  /// them in a row come a period and more late, one may stay counted too many or too few.
  int64_t periods() const { return periods_; }

 private:
  static constexpr int64_t kLeak = 300;  ///< one part in so many
  int64_t period_ns_, last_ns_ = 0, periods_ = 1;
  int64_t too_many_ = 0;  ///< periods without a sighting: so many may have been counted too many
  bool known_ = false;
};

}  // namespace takt
