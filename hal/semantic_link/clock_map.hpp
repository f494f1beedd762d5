// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace takt::semantic_link {

/// What the other end's CLOCK_MONOTONIC says against the own one, from round trips (RFC 5905, section 8). Of the newest
/// kSamples the one with the shortest round trip counts: whatever the two ways took, its offset is off by at most half
/// of that. One thread at a time.
class ClockMap {
 public:
  static constexpr size_t kSamples = 16;

  /// A request left here at `sent_ns` and came there at `heard_ns`; the answer left there at `answered_ns` and came
  /// here at `now_ns`. The middle two are the other end's clock. What no clocks can say is left out.
  void observe(int64_t sent_ns, int64_t heard_ns, int64_t answered_ns, int64_t now_ns);
  bool known() const { return count_ > 0; }
  /// To be added to an instant of the other end for the same instant here.
  int64_t to_own_ns() const { return best().to_own_ns; }
  /// An instant of the other end on the own clock; nothing while that is not known, or where no clock reaches.
  std::optional<int64_t> own_ns(int64_t others_ns) const;
  int64_t round_trip_ns() const { return best().round_trip_ns; }
  /// to_own_ns() is off by no more, but for what the clocks drift meanwhile.
  int64_t bound_ns() const { return (round_trip_ns() + 1) / 2; }

 private:
  struct Sample {
    int64_t round_trip_ns = 0, to_own_ns = 0;
  };
  const Sample& best() const;

  std::array<Sample, kSamples> samples_{};
  size_t count_ = 0;
};

}  // namespace takt::semantic_link
