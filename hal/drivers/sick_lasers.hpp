// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>

#include "hal/drivers.hpp"
#include "hal/laser/laser_scanner.hpp"
#include "hal/settings/settings.hpp"

namespace takt::hal {

/// The drivers `lms200` and `lms400`, closed; what is wrong with the settings is left in them.
std::unique_ptr<LaserScanner> make_lms200(const DeviceConfig& config, Settings& settings, const Clock& clock);
std::unique_ptr<LaserScanner> make_lms400(const DeviceConfig& config, Settings& settings, const Clock& clock);

}  // namespace takt::hal
