// SPDX-License-Identifier: Apache-2.0
#include "hal/camera/frame_trigger.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <optional>

#include "hal/gpio/pulse.hpp"

namespace takt::v4l2 {

FrameTrigger::FrameTrigger(FrameTriggerSettings settings, std::unique_ptr<gpio::LineChip> chip, const Clock& clock)
    : settings_(std::move(settings)), chip_(std::move(chip)), clock_(clock) {}

int FrameTrigger::open() {
  if (const int error = chip_->open(settings_.chip); error != 0) return error;
  const auto offset = gpio::find_line(*chip_, settings_.line);
  const int error = offset ? chip_->request_output(0, *offset, false) : ENOENT;
  if (error != 0) chip_->close();
  return error;
}

void FrameTrigger::start() {
  given_ = 0;
  asked_ns_ = INT64_MAX;
}

int FrameTrigger::give() {
  if (clock_.now_ns() < asked_ns_) return 0;
  asked_ns_ = INT64_MAX;
  const gpio::Pulse pulse = gpio::pulse(*chip_, 0, settings_.pulse_ns, clock_);
  if (pulse.error != 0) return pulse.error;
  pulses_[given_ % kKept] = {given_, pulse.stamp_ns};
  ++given_;
  return 0;
}

const FrameTrigger::Pulse* FrameTrigger::of(int64_t exposed_ns, int64_t within_ns) const {
  const Pulse* nearest = nullptr;
  for (uint32_t number = given_ - std::min(given_, kKept); number < given_; ++number) {
    const Pulse& pulse = pulses_[number % kKept];
    const int64_t off_ns = std::abs(exposed_ns - pulse.stamp_ns);
    if (off_ns >= within_ns) continue;
    within_ns = off_ns;
    nearest = &pulse;
  }
  return nearest;
}

}  // namespace takt::v4l2
