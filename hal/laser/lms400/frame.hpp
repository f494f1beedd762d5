// SPDX-License-Identifier: Apache-2.0
// Framing of the SICK LMS 400: four bytes 02h, length (four bytes, high one first), payload, exclusive or of the
// payload ("CoLa B" around plain text; devices.md 2.2 and 2.6). Pure functions over bytes: no I/O, no time, no
// exceptions, no heap.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "hal/stream/byte_window.hpp"

namespace takt::lms400 {

inline constexpr uint8_t kStx = 0x02;
inline constexpr size_t kLargestPayload = 4096;
inline constexpr size_t kHeader = 8, kFraming = kHeader + 1;

uint8_t checksum(std::span<const uint8_t> payload);

/// A whole frame.
class Frame {
 public:
  Frame() = default;
  /// At most kLargestPayload bytes; further ones are left out.
  explicit Frame(std::span<const uint8_t> payload);
  std::span<const uint8_t> bytes() const { return std::span(bytes_).first(size_); }

 private:
  std::array<uint8_t, kLargestPayload + kFraming> bytes_{};
  size_t size_ = 0;
};

enum class EventKind : uint8_t {
  frame,           ///< with a good checksum
  checksum_error,  ///< what began like a frame has another checksum
  length_error,    ///< what began like a frame claims an impossible length
};

struct Event {
  EventKind kind = EventKind::frame;
  uint64_t position = 0;             ///< of its first byte, counted from the first byte ever given to the parser
  std::span<const uint8_t> payload;  ///< of a frame; valid until the parser is called again
};

/// Finds frames in bytes, whatever they are, and however they are cut. Of a run of bytes 02h the last four begin a
/// frame. Where a candidate proves wrong, the search goes on one byte behind its beginning.
class Parser {
 public:
  /// Takes at least one of the bytes (how many, it returns) once next() has said that there is nothing left.
  size_t push(std::span<const uint8_t> bytes) { return window_.push(bytes); }
  std::optional<Event> next();
  /// True if bytes are left that may be the beginning of a frame, after next() has said that there is nothing.
  bool begun() const { return !window_.bytes().empty(); }
  /// Gives up what has begun: its rest did not come in time. next() then looks at the bytes behind its first.
  void abandon() { skip(begun() ? 1 : 0); }
  /// Bytes so far that belong to nothing.
  uint64_t skipped() const { return skipped_; }
  /// Forgets all bytes; positions go on.
  void reset();

 private:
  void skip(size_t bytes);

  ByteWindow<4 * kLargestPayload> window_;
  uint64_t skipped_ = 0;
  size_t claimed_ = 0;  ///< bytes of the frame that was returned last
};

/// Everything that is in `bytes` and in what came before: on_event(const Event&) for each.
template <class Function>
void parse(Parser& parser, std::span<const uint8_t> bytes, Function&& on_event) {
  do {
    bytes = bytes.subspan(parser.push(bytes));
    while (const auto event = parser.next()) on_event(*event);
  } while (!bytes.empty());
}

}  // namespace takt::lms400
