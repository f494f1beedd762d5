// SPDX-License-Identifier: Apache-2.0
#include "graph/run/iceoryx_daemon.hpp"

#include <fmt/format.h>

#include <ctime>

#include "rt/capability.hpp"
#include "rt/shm/transport_error.hpp"
#include "rt/supervise/private_mounts.hpp"

namespace takt::command {

std::unique_ptr<DaemonClaim> find_room_for_daemon(std::vector<std::string>& adjusted) {
  const auto claimed = [] {
    auto claim = std::make_unique<DaemonClaim>(IceoryxPlaces::of_this_machine());
    iceoryx_preflight(IceoryxPlaces::of_this_machine(), 0);
    return claim;
  };
  try {
    return claimed();
  } catch (const TransportError& taken) {
    const std::string refused = enter_private_mounts();
    if (!refused.empty()) throw TransportError(fmt::format("{} ({} was refused)", taken.what(), refused));
    adjusted.push_back(fmt::format("/tmp and /dev/shm -> private ones: {}", taken.what()));
    return claimed();
  }
}

DaemonProbe::DaemonProbe(Transport& transport, GroupSigns& signs, const Clock& clock)
    : thread_([&](const std::stop_token& end) {
        keep_rights(Rights::none);
        while (!end.stop_requested()) {
          transport.ask_daemon();
          signs.heartbeat_ns.store(clock.now_ns());
          const timespec pause{0, 200'000'000};
          nanosleep(&pause, nullptr);
        }
        signs.heartbeat_ns.store(0);
      }) {}

}  // namespace takt::command
