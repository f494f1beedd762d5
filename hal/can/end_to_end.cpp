// SPDX-License-Identifier: Apache-2.0
#include "hal/can/end_to_end.hpp"

namespace takt::can {
namespace {

uint8_t crc_step(uint8_t crc, uint8_t byte) {
  crc = static_cast<uint8_t>(crc ^ byte);
  for (int bit = 0; bit < 8; ++bit) crc = static_cast<uint8_t>(crc & 0x80 ? crc << 1 ^ 0x1D : crc << 1);
  return crc;
}

}  // namespace

uint8_t end_to_end_crc(uint16_t data_id, const Frame& frame) {
  uint8_t crc = crc_step(0, static_cast<uint8_t>(data_id));
  crc = crc_step(crc, static_cast<uint8_t>(data_id >> 8));
  for (size_t i = 1; i < frame.length; ++i) crc = crc_step(crc, frame.data[i]);
  return crc;
}

void EndToEndSender::protect(const Message& message, Frame& frame) {
  frame.data[1] = static_cast<uint8_t>((frame.data[1] & 0xF0) | next_);
  skip(1);
  frame.data[0] = end_to_end_crc(message.data_id(), frame);
}

EndToEndStatus EndToEndReceiver::check(const Message& message, const Frame& frame) {
  constexpr uint8_t kCounters = EndToEndSender::kCounters;
  if (frame.length != message.length) return EndToEndStatus::invalid;
  if (frame.data[0] != end_to_end_crc(message.data_id(), frame)) return EndToEndStatus::wrong_crc;
  const uint8_t counter = frame.data[1] & 0x0F;
  if (counter >= kCounters) return EndToEndStatus::invalid;
  const int delta = last_ == kNone ? -1 : (counter + kCounters - last_) % kCounters;
  last_ = counter;
  switch (delta) {
    case -1: return EndToEndStatus::initial;
    case 0: return EndToEndStatus::repeated;
    case 1: return EndToEndStatus::ok;
    default: return delta <= kMostDelta ? EndToEndStatus::ok_some_lost : EndToEndStatus::wrong_sequence;
  }
}

}  // namespace takt::can
