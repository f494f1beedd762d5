// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "hal/devices.hpp"

namespace takt::hal {

/// The driver `lms400`, closed.
NodeResult make_lms400(const DeviceConfig& config, Settings& settings, Devices& devices, const Clock& clock);

}  // namespace takt::hal
