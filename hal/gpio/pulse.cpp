// SPDX-License-Identifier: Apache-2.0
#include "hal/gpio/pulse.hpp"

#include <algorithm>

namespace takt::gpio {

Pulse pulse(LineChip& chip, size_t slot, int64_t width_ns, const Clock& clock) {
  const int64_t before_ns = clock.now_ns();
  if (const int error = chip.set(slot, true); error != 0) return {error, before_ns};
  const int64_t after_ns = clock.now_ns();
  while (!clock.is_virtual() && clock.now_ns() - after_ns < std::min(width_ns, kLongestPulse_ns)) {
  }
  return {chip.set(slot, false), before_ns + (after_ns - before_ns) / 2};
}

}  // namespace takt::gpio
