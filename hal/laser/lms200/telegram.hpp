// SPDX-License-Identifier: Apache-2.0
// Framing of the SICK LMS 2xx on its serial line (SICK 8007954, D-1.2, D-1.3 and D-1.10). Pure functions over
// bytes: no I/O, no time, no exceptions, no heap.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "hal/stream/frame_search.hpp"

namespace takt::lms200 {

inline constexpr uint8_t kStx = 0x02, kAck = 0x06, kNak = 0x15;
/// Added to the address of an LMS in what it says.
inline constexpr uint8_t kFromLms = 0x80;
inline constexpr size_t kLargestPayload = 812;  ///< the longest reply is one of 806
inline constexpr size_t kFraming = 6;           ///< STX, address, length of two bytes; CRC of two bytes
inline constexpr size_t kHeader = 4;

inline uint16_t read_u16(std::span<const uint8_t> bytes, size_t at) {
  return static_cast<uint16_t>(bytes[at] | bytes[at + 1] << 8);
}

/// The checksum of everything before it, low byte first on the line. One shift a byte, not eight, and each byte
/// together with the one before: no CRC-16 of a catalogue.
uint16_t crc(std::span<const uint8_t> bytes);

/// A whole telegram.
class Telegram {
 public:
  Telegram() = default;
  /// `payload`: command or reply code, data, and in replies the status byte; at most kLargestPayload bytes, further
  /// ones are left out.
  Telegram(uint8_t address, std::span<const uint8_t> payload);
  std::span<const uint8_t> bytes() const { return std::span(bytes_).first(size_); }

 private:
  std::array<uint8_t, kLargestPayload + kFraming> bytes_{};
  size_t size_ = 0;
};

enum class EventKind : uint8_t {
  telegram,      ///< with a good checksum
  ack,           ///< a single byte 06h
  nak,           ///< a single byte 15h
  crc_error,     ///< what began like a telegram has another checksum
  length_error,  ///< what began like a telegram claims an impossible length
};

struct Event {
  EventKind kind = EventKind::telegram;
  uint64_t position = 0;             ///< of its first byte, counted from the first byte ever given to the parser
  std::span<const uint8_t> payload;  ///< of a telegram; valid until the parser is called again
};

/// Finds telegrams in bytes, whatever they are, and however they are cut. A candidate begins with STX and the address
/// looked for; where it proves wrong, the search goes on one byte behind its STX, so that a whole telegram inside the
/// length that a broken one claims is found. 06h and 15h are ACK and NAK only at the very start and right behind a
/// whole telegram, an ACK or a NAK: elsewhere they are data.
class Parser : public FrameSearch<4096> {
 public:
  /// What an LMS says, or what is said to it. `address` of the LMS, 0..127.
  static Parser of_replies(uint8_t address = 0) { return Parser(static_cast<uint8_t>(address + kFromLms), 2); }
  static Parser of_commands(uint8_t address = 0) { return Parser(address, 1); }

  std::optional<Event> next();

 private:
  Parser(uint8_t address, size_t least) : address_(address), least_(least) {}

  uint8_t address_;
  size_t least_;  ///< payload: a reply has a status byte
};
using takt::parse;

}  // namespace takt::lms200
