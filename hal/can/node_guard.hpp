// SPDX-License-Identifier: Apache-2.0
// Network management and heartbeats in the manner of CiA 301.
#pragma once
#include <cstdint>

#include "hal/can/station.hpp"

namespace takt::can {

constexpr int64_t kHeartbeatPeriod_ns = 100'000'000;
constexpr int64_t kHeartbeatLost_ns = 300'000'000;

/// What a heartbeat says.
enum class NodeState : uint8_t { boot_up = 0, stopped = 4, operational = 5, pre_operational = 127 };
enum class NodeCommand : uint8_t { start = 1, stop = 2, pre_operational = 128, reset_node = 129, reset_comm = 130 };

/// Of the messages that every table of this floor has beside its own.
constexpr Signal kNodeCommandSignals[] = {{"NMT_Cmd", 0, 8, false, 1, 0, 0, 255},
                                          {"NMT_Node", 8, 8, false, 1, 0, 0, 127}};
constexpr Signal kHostHeartbeatSignals[] = {{"HB_HostState", 0, 8, false, 1, 0, 0, 127}};

/// A node, and the places of these messages and of its own heartbeat in its table.
struct NodePlaces {
  uint8_t node;
  size_t command, host_heartbeat, heartbeat;
};

/// The host's side: keeps one node operational, and knows whether it lives. One thread.
class NodeGuard {
 public:
  explicit NodeGuard(const NodePlaces& places) : places_(places) {}

  void begin() { *this = NodeGuard(places_); }
  /// The node's heartbeat arrived. True if the node has just booted: what it was told before it has forgotten.
  bool hear(NodeState state, int64_t stamp_ns);
  /// Each job: the host's heartbeat when it is due or the interface was down, and a start for a node that is there but
  /// not operational.
  void tend(Station& station, int64_t now_ns);
  /// Tells the node that the host goes.
  void end(Station& station) { command(station, NodeCommand::pre_operational); }

  bool operational(int64_t now_ns) const {
    return heard_ && state_ == NodeState::operational && now_ns - heard_ns_ < kHeartbeatLost_ns;
  }

 private:
  void command(Station& station, NodeCommand command);

  NodePlaces places_;
  bool heard_ = false;
  NodeState state_ = NodeState::boot_up;
  int64_t heard_ns_ = 0, beat_ns_ = INT64_MIN;
};

}  // namespace takt::can
