// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "rt/own_thread.hpp"
#include "rt/sched/outage_log.hpp"
#include "rt/shm/iceoryx_preflight.hpp"
#include "rt/shm/transport.hpp"
#include "rt/time/clock.hpp"

namespace takt::command {

/// The claim on a place for an iceoryx daemon, if need be a private one, which `adjusted` tells then. Throws
/// TransportError.
std::unique_ptr<DaemonClaim> find_room_for_daemon(std::vector<std::string>& adjusted);

/// Asks the daemon of the transport again and again, and leaves a sign of life each time it has answered. Afterwards no
/// sign is expected: what the supervisor still has to do, such as its report, may take longer.
class DaemonProbe {
 public:
  DaemonProbe(Transport& transport, GroupSigns& signs, const Clock& clock);

 private:
  OwnThread thread_;
};

}  // namespace takt::command
