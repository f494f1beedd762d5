// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "hal/semantic_link/packet.hpp"

namespace takt::semantic_link {

/// Puts the fragments of one kind of message together, one message at a time: the newest one that has begun. Takes its
/// memory once.
class Assembly {
 public:
  explicit Assembly(size_t most_bytes) : buffer_(most_bytes) {}

  enum class Step : uint8_t { incomplete, complete, refused };
  /// A packet that read_packet() gave. Refused: larger than there is room for, or not of the message whose number it
  /// has.
  Step add(const Packet& packet);
  /// After `complete`, until the next call.
  std::span<const uint8_t> message() const { return message_; }
  /// Messages given up because a newer one began before their last fragment had come.
  uint64_t given_up() const { return given_up_; }
  /// Another session: numbers begin anew.
  void reset() { have_ = number_ = 0; }

 private:
  std::vector<uint8_t> buffer_;
  std::span<const uint8_t> message_;
  uint32_t number_ = 0, message_bytes_ = 0;
  size_t unit_ = 0;
  uint64_t have_ = 0;  ///< a bit a fragment; 0: none has begun
  uint64_t given_up_ = 0;
};

}  // namespace takt::semantic_link
