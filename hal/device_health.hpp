// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/hal/device_health.hpp>: hal, experimental.
#pragma once
#include <cstdint>
#include <optional>

#include "hal/device.hpp"
#include "rt/source_state.hpp"

namespace takt {

struct DeviceHealthSettings {
  int64_t silent_after_ns = 0;   ///< of no good data until the device counts as lost; 0: the default for its rate
  int64_t starts_within_ns = 0;  ///< until the first good data a device may take longer than silent_after, up to this
  int64_t recovers_after_ns = 500'000'000;  ///< of good data without a break until a lost device counts as back
  bool judges_frozen = true;                ///< false: repeated data are good, as of a recording of one image
};

/// Three periods of a device's jobs, at least 300 ms; without a rate 300 ms.
int64_t default_silent_after_ns(int64_t period_ns);

/// Judges a device by what its jobs read, at their planned releases: the same reads give the same answers, whatever the
/// clock. No allocation. One thread at a time.
///
/// disconnected: at once. silent, garbage, frozen: no good read for `silent_after`, or none at all for `starts_within`;
/// all reads since were damaged, all were repetitions, or else. ok: good data for `recovers_after` without a break, a
/// break being a bad read or `silent_after` without any data (a device may be slower than its jobs). So a loose plug
/// does not change the state with each contact, and a device counts as lost until it has shown that it works.
class DeviceHealth {
 public:
  /// silent_after_ns > 0.
  explicit DeviceHealth(const DeviceHealthSettings& settings) : settings_(settings) {}

  /// What the job released then read; `repeated`: the data are those of the read before. Releases never go back.
  /// `end_of_data` is no reading and changes nothing.
  void observe(int64_t release_ns, ReadStatus status, bool repeated);
  /// Nothing until the first loss, or the first `recovers_after` of good data.
  std::optional<SourceState> state() const { return state_; }

 private:
  void observe_good(int64_t release_ns);
  SourceState kind_of_loss() const;
  /// How long it may be without good data.
  int64_t patience_ns() const;

  DeviceHealthSettings settings_;
  std::optional<SourceState> state_;
  std::optional<int64_t> good_since_ns_;  ///< of the good data that go on
  std::optional<int64_t> bad_since_ns_;   ///< first read, last good one, or last one that said disconnected
  std::optional<int64_t> last_good_ns_;
  uint32_t reads_ = 0, damaged_ = 0, repeated_ = 0;  ///< since then
};

/// When to try again what failed: after 100 ms, then each time after twice as long, at most 1 s. One thread at a time.
class RetryDelay {
 public:
  static constexpr int64_t kFirst_ns = 100'000'000, kLongest_ns = 1'000'000'000;

  bool due(int64_t now_ns) const { return now_ns >= next_ns_; }
  void failed(int64_t now_ns) {
    next_ns_ = now_ns + delay_ns_;
    delay_ns_ = delay_ns_ < kLongest_ns / 2 ? delay_ns_ * 2 : kLongest_ns;
  }
  /// What was tried works, and has for a while: the next failure is a new one.
  void works() { *this = {}; }

 private:
  int64_t next_ns_ = INT64_MIN, delay_ns_ = kFirst_ns;
};

}  // namespace takt
