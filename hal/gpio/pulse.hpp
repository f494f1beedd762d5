// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>

#include "hal/gpio/line_chip.hpp"
#include "rt/time/clock.hpp"

namespace takt::gpio {

constexpr int64_t kLongestPulse_ns = 1'000'000;

struct Pulse {
  int error = 0;         ///< an errno: the line may have risen all the same
  int64_t stamp_ns = 0;  ///< when the line rose: in the middle between the call and its return
};

/// Raises an output for at least `width_ns`, at most kLongestPulse_ns, and lets it fall: the caller waits for that,
/// awake. In virtual time it falls at once.
Pulse pulse(LineChip& chip, size_t slot, int64_t width_ns, const Clock& clock);

}  // namespace takt::gpio
