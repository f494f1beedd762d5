// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "rt/msg/ace/stop_command.hpp"
#include "rt/node.hpp"

namespace takt {

/// Whether a robot stands whatever speeds are wanted. Silence means stop: a connected `stop` without a command, or with
/// one older than its edge allows. In the mode safe_stop it stays where it is; in a mode without a name nobody has said
/// that it may drive.
inline bool must_stand(const Input<StopCommand>& stop, std::string_view mode) {
  const bool stopped = stop.connected() && (stop.empty() || stop.stale() || stop.newest()->stop());
  return stopped || mode.empty() || mode == kSafeStopMode;
}

}  // namespace takt
