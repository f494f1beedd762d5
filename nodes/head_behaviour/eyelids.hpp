// SPDX-License-Identifier: Apache-2.0
// When the lids before the cameras are closed: against the sun, and for a moment while somebody deals with the robot
// (thesis App. A; ).
#pragma once
#include <cstdint>
#include <optional>
#include <random>

#include "rt/state_archive.hpp"

namespace takt::head_behaviour {

struct SunParameters {
  int confirm = 3;      ///< saturated images in a row that close the lid
  double shut_s = 5;    ///< so long; then it opens to look again
  double lift_s = 0.5;  ///< that a lid takes to open: images taken meanwhile say nothing
};

/// A lid that is closed shows nothing of the sun, so the way back leads over time: it opens to look, and what it sees
/// closes it again. One thread at a time; allocates nothing.
class SunGuard {
 public:
  SunGuard() = default;
  explicit SunGuard(const SunParameters& parameters) : parameters_(parameters) {}
  void tune(const SunParameters& parameters) { parameters_ = parameters; }
  /// An image of that stamp with more than 5 % of its pixels saturated, or not.
  void see(bool saturated, int64_t stamp_ns, int64_t now_ns);
  bool closed(int64_t now_ns) const { return now_ns < open_from_ns_; }
  void remember(StateArchive& archive) { TAKT_STATE(archive, open_from_ns_, seen_ns_, saturated_); }

 private:
  SunParameters parameters_;
  int64_t open_from_ns_ = INT64_MIN, seen_ns_ = INT64_MIN;
  int saturated_ = 0;  ///< images in a row
};

struct BlinkParameters {
  double every_s = 4;     ///< on average: intervals are drawn from half to one and a half times that
  double closed_s = 0.5;  ///< the lid is told to be closed for so long, its own way included
};

/// Blinks while there is a partner. The same seed gives the same intervals. One thread at a time; allocates nothing.
class Blinker {
 public:
  Blinker() = default;
  Blinker(const BlinkParameters& parameters, uint64_t seed)
      : parameters_(parameters), random_(static_cast<std::minstd_rand::result_type>(seed)) {}
  /// For the blinks after the next one, whose begin is drawn already.
  void tune(const BlinkParameters& parameters) { parameters_ = parameters; }
  bool closed(bool has_partner, int64_t now_ns);
  void remember(StateArchive& archive) { TAKT_STATE(archive, random_, next_ns_); }

 private:
  BlinkParameters parameters_;
  std::minstd_rand random_;
  std::optional<int64_t> next_ns_;  ///< begin of the next blink, or of the one under way
};

}  // namespace takt::head_behaviour
