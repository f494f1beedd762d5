// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <utility>

#include "hal/stream/byte_window.hpp"

namespace takt {

/// What parsers share that look for frames in any bytes: they skip a byte, wait for more, or claim a frame.
template <size_t Capacity>
class FrameSearch {
 public:
  /// Takes at least one of the bytes (how many, it returns) once next() of the parser has said that there is nothing
  /// left; Capacity is more than any frame.
  size_t push(std::span<const uint8_t> bytes) { return window_.push(bytes); }
  /// True if bytes are left that may be the beginning of a frame, after next() has said that there is nothing.
  bool begun() const { return !window_.bytes().empty(); }
  /// Gives up what has begun: its rest did not come in time. next() then looks at the bytes behind its first.
  void abandon() { skip(begun() ? 1 : 0); }
  /// Forgets all bytes; positions go on.
  void reset() {
    window_.drop(window_.bytes().size());
    claimed_ = 0;
    boundary_ = window_.position();
  }
  /// Bytes so far that belong to nothing.
  uint64_t skipped() const { return skipped_; }

 protected:
  std::span<const uint8_t> bytes() const { return window_.bytes(); }
  uint64_t position() const { return window_.position(); }
  /// The next byte follows a frame, or nothing at all.
  bool at_boundary() const { return window_.position() == boundary_; }
  void skip(size_t count) {
    window_.drop(count);
    skipped_ += count;
  }
  /// The first bytes are a frame. They stay until drop_claimed(), the next thing that next() does.
  void claim(size_t count) { claimed_ = count; }
  void drop_claimed() {
    if (claimed_ == 0) return;
    window_.drop(std::exchange(claimed_, 0));
    boundary_ = window_.position();
  }

 private:
  ByteWindow<Capacity> window_;
  size_t claimed_ = 0;
  uint64_t boundary_ = 0, skipped_ = 0;
};

/// Everything that is in `bytes` and in what came before: on_event(event) for each.
template <class Parser, class Function>
void parse(Parser& parser, std::span<const uint8_t> bytes, Function&& on_event) {
  do {
    bytes = bytes.subspan(parser.push(bytes));
    while (const auto event = parser.next()) on_event(*event);
  } while (!bytes.empty());
}

}  // namespace takt
