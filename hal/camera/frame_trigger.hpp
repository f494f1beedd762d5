// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <string>

#include "hal/gpio/line_chip.hpp"
#include "rt/time/clock.hpp"

namespace takt::v4l2 {

struct FrameTriggerSettings {
  std::string chip, line;      ///< /dev/gpiochip0; name or offset of an output
  int64_t pulse_ns = 100'000;  ///< at least so long it is high; the job waits for it
};

/// The line that makes a camera expose. It numbers its pulses and knows which of them a frame is of: by the stamps,
/// since a frame may get lost (D-9). On the thread that owns the camera.
class FrameTrigger {
 public:
  struct Pulse {
    uint32_t number = 0;  ///< since the start
    int64_t stamp_ns = 0;
  };
  FrameTrigger(FrameTriggerSettings settings, std::unique_ptr<gpio::LineChip> chip, const Clock& clock);

  /// 0 or an errno; ENOENT: no such chip or line.
  int open();
  void close() { chip_->close(); }
  /// Forgets every pulse.
  void start();
  void ask(int64_t at_ns) { asked_ns_ = at_ns; }
  /// The pulse that was asked for, once its instant has come; 0 or an errno.
  int give();
  /// The pulse nearest to that begin of an exposure, if it is nearer than `within_ns`.
  const Pulse* of(int64_t exposed_ns, int64_t within_ns) const;

  uint32_t pulses() const { return given_; }
  /// Null: none yet.
  const Pulse* newest() const { return given_ == 0 ? nullptr : &pulses_[(given_ - 1) % kKept]; }
  const FrameTriggerSettings& settings() const { return settings_; }

 private:
  static constexpr uint32_t kKept = 16;  ///< twice what frames can wait

  FrameTriggerSettings settings_;
  std::unique_ptr<gpio::LineChip> chip_;
  const Clock& clock_;
  int64_t asked_ns_ = INT64_MAX;  ///< INT64_MAX: nothing
  std::array<Pulse, kKept> pulses_;
  uint32_t given_ = 0;
};

}  // namespace takt::v4l2
