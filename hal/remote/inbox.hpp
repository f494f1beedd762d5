// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

#include "rt/memory/aligned_bytes.hpp"
#include "rt/msg/field.hpp"

namespace takt {

/// Messages of one output of another machine, from the thread that receives them to the job that hands them on. Neither
/// waits for the other, and nothing is allocated. One thread fills, one takes.
///
///   if (Inbox::Message* message = inbox.to_fill()) unpack(..., message->memory.get()), inbox.filled();   // one thread
///   if (const Inbox::Message* message = inbox.next(job.release_ns())) use(*message), inbox.taken();      // the other
class Inbox {
 public:
  struct Message {
    AlignedBytes memory;  ///< placed
    int64_t stamp_ns = 0;
    int64_t visible_at_ns = 0;  ///< no job that is released before may have it
  };
  Inbox(const MessageType& type, const Capacity& capacity);

  /// Null: there is no room, since nothing was taken for long.
  Message* to_fill();
  void filled() { filled_.fetch_add(1, std::memory_order_release); }
  /// The oldest one, once it may be seen at that time.
  const Message* next(int64_t release_ns) const;
  void taken() { taken_.fetch_add(1, std::memory_order_release); }
  uint64_t message_bytes() const { return bytes_; }

 private:
  static constexpr size_t kMessages = 8;
  const MessageType& type_;
  const Capacity capacity_;
  const uint64_t bytes_;
  std::array<Message, kMessages> messages_;
  std::atomic<uint64_t> filled_{0}, taken_{0};
};

}  // namespace takt
