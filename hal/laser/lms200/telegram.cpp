// SPDX-License-Identifier: Apache-2.0
#include "hal/laser/lms200/telegram.hpp"

#include <algorithm>

namespace takt::lms200 {

uint16_t crc(std::span<const uint8_t> bytes) {
  constexpr uint32_t kPolynomial = 0x8005;
  uint32_t sum = 0, previous = 0;
  for (const uint8_t byte : bytes) {
    sum = (sum << 1 ^ ((sum & 0x8000) != 0 ? kPolynomial : 0)) & 0xFFFF;
    sum ^= previous << 8 | byte;
    previous = byte;
  }
  return static_cast<uint16_t>(sum);
}

Telegram::Telegram(uint8_t address, std::span<const uint8_t> payload) {
  payload = payload.first(std::min(payload.size(), kLargestPayload));
  bytes_[0] = kStx;
  bytes_[1] = address;
  bytes_[2] = static_cast<uint8_t>(payload.size());
  bytes_[3] = static_cast<uint8_t>(payload.size() >> 8);
  std::copy(payload.begin(), payload.end(), bytes_.begin() + kHeader);
  const size_t end = kHeader + payload.size();
  const uint16_t sum = crc(std::span(bytes_).first(end));
  bytes_[end] = static_cast<uint8_t>(sum);
  bytes_[end + 1] = static_cast<uint8_t>(sum >> 8);
  size_ = end + 2;
}

std::optional<Event> Parser::next() {
  drop_claimed();
  for (; !bytes().empty(); skip(1)) {
    const auto bytes = this->bytes();
    if (at_boundary() && (bytes[0] == kAck || bytes[0] == kNak)) {
      claim(1);
      return Event{bytes[0] == kAck ? EventKind::ack : EventKind::nak, position(), {}};
    }
    if (bytes[0] != kStx || (bytes.size() > 1 && bytes[1] != address_)) continue;
    if (bytes.size() < kHeader) return std::nullopt;
    const auto refused = [this](EventKind kind) {
      const Event event{kind, position(), {}};
      skip(1);
      return event;
    };
    const size_t length = read_u16(bytes, 2);
    if (length < least_ || length > kLargestPayload) return refused(EventKind::length_error);
    if (bytes.size() < length + kFraming) return std::nullopt;
    if (crc(bytes.first(kHeader + length)) != read_u16(bytes, kHeader + length)) return refused(EventKind::crc_error);
    claim(length + kFraming);
    return Event{EventKind::telegram, position(), bytes.subspan(kHeader, length)};
  }
  return std::nullopt;
}

}  // namespace takt::lms200
