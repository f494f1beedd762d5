// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "graph/machines/coding.hpp"
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
  Coding coding = Coding::plain;
  std::span<const std::byte> coded;  ///< fields as rt/record/packed_message.hpp has them, in that coding
};

/// Makes frames of the messages of one output. Keeps its memory from message to message. One thread at a time.
///
///   Framer framer(MessageType::of<Image>(), Coding::zstd);
///   wire.send(topic, framer.frame(run, held));
class Framer {
 public:
  Framer(const MessageType& type, Coding coding) : type_(&type), coder_(coding) {}
  /// Valid until the next call.
  std::span<const std::byte> frame(uint64_t run, const Held& held);

 private:
  const MessageType* type_;
  Coder coder_;
  std::vector<std::byte> packed_, frame_;
};

/// Error: what came is none, or its bytes are not those that were sent (XXH3).
tl::expected<Frame, std::string> frame_of(std::span<const std::byte> bytes);

}  // namespace takt::machines
