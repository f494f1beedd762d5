// SPDX-License-Identifier: Apache-2.0
// AUTOSAR E2E profile 1, variant 1A: a frame that was changed, taken from another message, repeated or lost is seen.
#pragma once
#include <cstdint>

#include "hal/can/codec.hpp"

namespace takt::can {

/// CRC-8, polynomial 1Dh, start 0, no final XOR, over data ID low, data ID high and the bytes of the frame but the
/// first.
uint8_t end_to_end_crc(uint16_t data_id, const Frame& frame);

/// One message's counter on the sending side.
class EndToEndSender {
 public:
  static constexpr uint8_t kCounters = 15;  ///< 0..14; 15 is never sent
  explicit EndToEndSender(uint8_t next = 0) : next_(next) {}
  /// Writes counter and CRC.
  void protect(const Message& message, Frame& frame);
  /// As if so many frames had been sent.
  void skip(uint8_t frames) { next_ = static_cast<uint8_t>((next_ + frames) % kCounters); }

 private:
  uint8_t next_;
};

enum class EndToEndStatus : uint8_t {
  initial,         ///< the first one: nothing to compare its counter with
  ok,              ///< the one after the last
  ok_some_lost,    ///< up to two are missing
  repeated,        ///< the last one again
  wrong_sequence,  ///< more are missing; the next one is compared with this one
  wrong_crc,       ///< changed on the way, or another message
  invalid,         ///< length or counter that no sender makes
};

constexpr bool usable(EndToEndStatus status) {
  return status == EndToEndStatus::ok || status == EndToEndStatus::ok_some_lost;
}

/// One message's counter on the receiving side. Frames that are refused for their CRC leave it as it is.
class EndToEndReceiver {
 public:
  static constexpr uint8_t kMostDelta = 3;
  EndToEndStatus check(const Message& message, const Frame& frame);

 private:
  static constexpr uint8_t kNone = 0xFF;
  uint8_t last_ = kNone;
};

}  // namespace takt::can
