// SPDX-License-Identifier: Apache-2.0
#include "hal/remote/inbox.hpp"

namespace takt {

Inbox::Inbox(const MessageType& type, const Capacity& capacity)
    : type_(type), capacity_(capacity), bytes_(type.bytes(capacity)) {
  for (Message& message : messages_) message.memory = aligned_bytes(bytes_);
}

Inbox::Message* Inbox::to_fill() {
  const uint64_t at = filled_.load(std::memory_order_relaxed);
  if (at - taken_.load(std::memory_order_acquire) == kMessages) return nullptr;
  Message& message = messages_[at % kMessages];
  type_.place(message.memory.get(), capacity_);
  return &message;
}

const Inbox::Message* Inbox::next(int64_t release_ns) const {
  const uint64_t at = taken_.load(std::memory_order_relaxed);
  if (at == filled_.load(std::memory_order_acquire)) return nullptr;
  const Message& message = messages_[at % kMessages];
  return message.visible_at_ns <= release_ns ? &message : nullptr;
}

}  // namespace takt
