// SPDX-License-Identifier: Apache-2.0
#include "hal/laser/lms200/telegram.hpp"

#include <algorithm>
#include <utility>

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
  window_.drop(std::exchange(claimed_, 0));
  for (;;) {
    const auto bytes = window_.bytes();
    if (bytes.empty()) return std::nullopt;
    const uint64_t position = window_.position();
    if (in_step_ && (bytes[0] == kAck || bytes[0] == kNak)) {
      const EventKind kind = bytes[0] == kAck ? EventKind::ack : EventKind::nak;
      window_.drop(1);
      return Event{kind, position, {}};
    }
    if (bytes[0] != kStx || (bytes.size() > 1 && bytes[1] != address_)) {
      skip();
      continue;
    }
    if (bytes.size() < kHeader) return std::nullopt;
    const size_t length = read_u16(bytes, 2);
    if (length < least_ || length > kLargestPayload) {
      skip();
      return Event{EventKind::length_error, position, {}};
    }
    if (bytes.size() < length + kFraming) return std::nullopt;
    if (crc(bytes.first(kHeader + length)) != read_u16(bytes, kHeader + length)) {
      skip();
      return Event{EventKind::crc_error, position, {}};
    }
    claimed_ = length + kFraming;
    in_step_ = true;
    return Event{EventKind::telegram, position, bytes.subspan(kHeader, length)};
  }
}

void Parser::skip() {
  window_.drop(1);
  ++skipped_;
  in_step_ = false;
}

void Parser::abandon() {
  if (begun()) skip();
}

void Parser::reset() {
  window_.drop(window_.bytes().size());
  claimed_ = 0;
  in_step_ = true;
}

}  // namespace takt::lms200
