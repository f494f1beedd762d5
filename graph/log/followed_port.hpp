// SPDX-License-Identifier: Apache-2.0
// An output of a run that is followed (graph/attach/follow.hpp): what `describe` says of it, and its messages.
//
//   FollowedPort port(described, types);
//   if (port.type != nullptr && port.fill(packed)) port.type->show(port.memory.get(), viewer);
#pragma once
#include <optional>
#include <span>

#include "graph/language/message_types.hpp"
#include "graph/log/recorded_type.hpp"
#include "rt/memory/aligned_bytes.hpp"

namespace takt::log {

struct FollowedPort {
  FollowedPort() = default;
  /// `described`: one of `ports` of a `describe`.
  FollowedPort(const nlohmann::ordered_json& described, const graph::MessageTypes& types);
  /// Unpacks a message into `memory`. False: its type is not known here, or the bytes are no sound message of it.
  bool fill(std::span<const std::byte> packed);

  std::optional<RecordedType> recorded;  ///< nothing: the run does not list its fields
  const MessageType* type = nullptr;     ///< null: known by its fields alone
  Capacity capacity;
  AlignedBytes memory;  ///< of the newest message
};

}  // namespace takt::log
