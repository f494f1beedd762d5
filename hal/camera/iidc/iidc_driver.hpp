// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "hal/camera/iidc/dc1394_calls.hpp"
#include "hal/devices.hpp"
#include "hal/gpio/line_chip.hpp"

namespace takt::hal {

/// The driver `iidc`, closed, over those functions (null: the library is not there) and the chip of its trigger (null:
/// the kernel's).
NodeResult make_iidc_camera(const DeviceConfig& config, Settings& settings, const Clock& clock,
                            const iidc::Dc1394Calls* calls, std::unique_ptr<gpio::LineChip> chip);

/// Adds the driver to the kind `stereo_camera`.
void add_iidc_camera(DeviceTypes& types);

}  // namespace takt::hal
