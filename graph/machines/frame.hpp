// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "rt/msg/field.hpp"
#include "rt/shm/transport.hpp"

namespace takt::machines {

/// A message on its way to another machine: what a record has of it, and which run of the sender it belongs to. Times
/// are the sender's. Little-endian.
struct Frame {
  uint64_t run = 0;  ///< another number after each start of the sender
  uint64_t sequence = 0;
  int64_t stamp_ns = 0, published_ns = 0;
  int32_t level = 0;
  std::span<const std::byte> packed;  ///< fields as rt/record/packed_message.hpp has them
};

/// Appends the message that is held.
void put(uint64_t run, const MessageType& type, const Held& held, std::vector<std::byte>& to);

/// Error: what came is none, or its bytes are not those that were sent (XXH3).
tl::expected<Frame, std::string> frame_of(std::span<const std::byte> bytes);

}  // namespace takt::machines
