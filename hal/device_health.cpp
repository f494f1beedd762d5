// SPDX-License-Identifier: Apache-2.0
#include "hal/device_health.hpp"

#include <algorithm>

namespace takt {

int64_t default_silent_after_ns(int64_t period_ns) { return std::max<int64_t>(300'000'000, 3 * period_ns); }

void DeviceHealth::observe(int64_t release_ns, ReadStatus status, bool repeated) {
  if (status == ReadStatus::end_of_data) return;
  const bool frozen = repeated && settings_.judges_frozen;
  if (status == ReadStatus::ok && !frozen) return observe_good(release_ns);
  if (!bad_since_ns_) bad_since_ns_ = release_ns;
  if (status == ReadStatus::disconnected) {
    state_ = SourceState::disconnected;
    good_since_ns_.reset();
    bad_since_ns_ = release_ns;
    reads_ = damaged_ = repeated_ = 0;
    return;
  }
  ++reads_;
  damaged_ += status == ReadStatus::partial ? 1 : 0;
  repeated_ += status == ReadStatus::ok ? 1 : 0;
  const bool over = release_ns - *bad_since_ns_ >= patience_ns();
  if (status != ReadStatus::no_data || over) good_since_ns_.reset();
  if (over) state_ = kind_of_loss();
}

void DeviceHealth::observe_good(int64_t release_ns) {
  if (good_since_ns_ && release_ns - *last_good_ns_ >= settings_.silent_after_ns) good_since_ns_.reset();
  if (!good_since_ns_) good_since_ns_ = release_ns;
  last_good_ns_ = release_ns;
  bad_since_ns_ = release_ns;
  reads_ = damaged_ = repeated_ = 0;
  if (release_ns - *good_since_ns_ >= settings_.recovers_after_ns) state_ = SourceState::ok;
}

int64_t DeviceHealth::patience_ns() const {
  return last_good_ns_ ? settings_.silent_after_ns : std::max(settings_.silent_after_ns, settings_.starts_within_ns);
}

SourceState DeviceHealth::kind_of_loss() const {
  if (damaged_ == reads_) return SourceState::garbage;
  if (repeated_ == reads_) return SourceState::frozen;
  return SourceState::silent;
}

}  // namespace takt
