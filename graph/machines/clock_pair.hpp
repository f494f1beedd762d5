// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace takt::machines {

/// How far the monotonic clock of another machine is from this one's, and how well that is known: from messages that go
/// to and fro, by the four times of NTP (RFC 5905, section 8). No synchronised clocks are needed.
///
///   pair.add({sent_here, received_there, sent_there, received_here});
///   if (const auto there = pair.offset(now_ns)) here_ns = there_ns - there->offset_ns;   // +- there->error_ns
///
/// The true offset lies within `error_ns` of the one told: half of the way to and fro, and what both clocks may have
/// drifted since. Two exchanges that exclude each other mean that a clock has jumped: the older ones are forgotten. One
/// thread at a time.
class ClockPair {
 public:
  struct Exchange {
    int64_t sent_here_ns = 0, received_there_ns = 0, sent_there_ns = 0, received_here_ns = 0;
  };
  struct Offset {
    int64_t offset_ns = 0;  ///< clock there minus clock here
    int64_t error_ns = 0;
  };
  /// Both clocks together gain or lose at most this: quartz is within 100 ppm.
  static constexpr int64_t kDrift_ppm = 200;

  /// One whose times contradict each other is left out.
  void add(const Exchange& exchange);
  /// Of the exchange that tells most at that time, which is here's. Nothing: there was none yet.
  std::optional<Offset> offset(int64_t now_ns) const;
  uint64_t jumps() const { return jumps_; }

 private:
  struct Known {
    int64_t at_ns = 0;
    Offset offset;
  };
  static int64_t error_at(const Known& known, int64_t now_ns);

  std::array<Known, 32> known_{};  ///< the newest ones
  size_t count_ = 0;               ///< that there ever were
  uint64_t jumps_ = 0;
};

/// Stamps of another machine in this one's clock. What has one stamp there has one here, whatever was learnt of the
/// clock between two messages: joins need that.
///
///   message.stamp_ns = stamps.here(frame.stamp_ns, offset.offset_ns);
class Stamps {
 public:
  /// One thread at a time.
  int64_t here(int64_t there_ns, int64_t offset_ns);
  void forget() { count_ = 0; }

 private:
  struct Pair {
    int64_t there_ns = 0, here_ns = 0;
  };
  std::array<Pair, 256> known_{};  ///< the newest ones
  size_t count_ = 0;
};

}  // namespace takt::machines
