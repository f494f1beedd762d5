// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

namespace takt {

/// Gives this process (and those it forks) a /dev/shm and a /tmp of their own, in which no other iceoryx daemon lives:
/// iceoryx allows one daemon per machine because its lock and sockets have fixed places. Everything else that lies in
/// /tmp now stays visible there and writable; what is made directly in /tmp from now on is seen by this run alone.
/// Needs CAP_SYS_ADMIN. Empty on success, else what was refused. Before any thread starts.
std::string enter_private_mounts();

}  // namespace takt
