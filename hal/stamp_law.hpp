// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/hal/stamp_law.hpp>: hal, experimental.
#pragma once
#include <cstdint>
#include <optional>
#include <string>

#include "rt/time/rate.hpp"

namespace takt {

/// How old what a device gives can be, from its settings and its datasheet alone: a job that is released at r reads
/// something whose stamp lies at most lag_ns() before r. For instance a camera at 15 Hz of its own that exposes for at
/// most 8 ms and sends for 25 ms: latency 33 ms, period 66.7 ms, lag 99.7 ms. Admission counts on it (`takt check`
/// prints it); what a device tells once it is open may be less, never more. Plain data; any thread.
struct StampLaw {
  int64_t latency_ns = 0;  ///< from the stamp until the host has the data: exposure, sweep, sending
  int64_t period_ns = 0;   ///< at a pace of its own: longest distance of two measurements; 0: it measures when asked
  int64_t wait_ns = 0;     ///< so long after its release a job may sleep for the measurement that it asked for
  std::string unknown{};   ///< why nobody can tell; empty: the above is a bound

  int64_t lag_ns() const { return latency_ns + period_ns; }
  /// A device of which nothing can be told in advance, with the reason.
  static StampLaw none(std::string why) { return {0, 0, 0, std::move(why)}; }
};

/// When the jobs are released that read a device; without a rate: not known.
struct JobTimes {
  std::optional<Rate> rate{};
  int64_t offset_ns = 0;
};

}  // namespace takt
