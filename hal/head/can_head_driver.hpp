// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "hal/devices.hpp"

namespace takt::hal {

/// The driver `can` of a camera head, closed.
NodeResult make_can_head(const DeviceConfig& config, Settings& settings, Devices& devices, const Clock& clock);

}  // namespace takt::hal
