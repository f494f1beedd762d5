// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "hal/devices.hpp"

namespace takt::hal {

/// The driver `can` of a mobile base, closed.
NodeResult make_can_base(const DeviceConfig& config, Settings& settings, Devices& devices, const Clock& clock);

}  // namespace takt::hal
