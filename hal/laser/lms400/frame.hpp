// SPDX-License-Identifier: Apache-2.0
// Framing of the SICK LMS 400: four bytes 02h, length (four bytes, high one first), payload, exclusive or of the
// payload ("CoLa B" around plain text; D-2.2 and D-2.6). Pure functions over bytes: no I/O, no time, no
// exceptions, no heap.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "hal/stream/frame_search.hpp"

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
class Parser : public FrameSearch<4 * kLargestPayload> {
 public:
  std::optional<Event> next();
};
using takt::parse;

}  // namespace takt::lms400
