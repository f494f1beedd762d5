// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>

#include "rt/supervise/outward_watchdog.hpp"

namespace takt {

/// The service manager that started this process (sd_notify: READY=1, WATCHDOG=1, STATUS=, STOPPING=1); null if none
/// did, that is without NOTIFY_SOCKET. Its timeout is WATCHDOG_USEC of the environment, 0 without.
std::unique_ptr<WatchdogSink> systemd_sink();

}  // namespace takt
