// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>

#include "hal/devices.hpp"
#include "hal/interaction/web.hpp"

namespace takt::hal {

/// The driver `web`, closed. `fingers`: of its double; null: there is none.
NodeResult make_web_screen(const DeviceConfig& config, Settings& settings, const Clock& clock,
                           std::shared_ptr<AnswerLine> fingers);

}  // namespace takt::hal
