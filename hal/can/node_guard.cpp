// SPDX-License-Identifier: Apache-2.0
#include "hal/can/node_guard.hpp"

namespace takt::can {

bool NodeGuard::hear(NodeState state, int64_t stamp_ns) {
  const bool booted = heard_ && state == NodeState::boot_up;
  heard_ = true;
  state_ = state;
  heard_ns_ = stamp_ns;
  return booted;
}

void NodeGuard::tend(Station& station, int64_t now_ns) {
  const bool due = beat_ns_ == INT64_MIN || now_ns - beat_ns_ >= kHeartbeatPeriod_ns;
  // While the interface is down every job tries: nothing but a frame that leaves tells that it is up again.
  if (!due && station.link() != Link::down) return;
  beat_ns_ = now_ns;
  station.send(places_.host_heartbeat, std::array{static_cast<double>(NodeState::operational)});
  if (!operational(now_ns)) command(station, NodeCommand::start);
}

void NodeGuard::command(Station& station, NodeCommand command) {
  station.send(places_.command, std::array{static_cast<double>(command), static_cast<double>(places_.node)});
}

}  // namespace takt::can
