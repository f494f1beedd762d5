// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "hal/devices.hpp"
#include "hal/gpio/line_chip.hpp"

namespace takt::hal {

/// The driver `gpio`, closed, on that chip; null: the kernel's.
NodeResult make_gpio_lines(const DeviceConfig& config, Settings& settings, const Clock& clock,
                           std::unique_ptr<gpio::LineChip> chip);

/// The length of a pulse, as that setting says.
int64_t pulse_ns(Settings& settings, const char* name);
/// That one; null: the kernel's.
std::unique_ptr<gpio::LineChip> chip_or(std::unique_ptr<gpio::LineChip> seam);

}  // namespace takt::hal
