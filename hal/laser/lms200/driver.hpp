// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "hal/devices.hpp"

namespace takt::hal {

/// The driver `lms200`, closed.
NodeResult make_lms200(const DeviceConfig& config, Settings& settings, Devices& devices, const Clock& clock);

}  // namespace takt::hal
