// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "hal/stream/byte_clock.hpp"
#include "hal/stream/frame_search.hpp"

namespace takt {

/// The receiving half of a session: bytes become events, and it is known when they came.
template <class Parser>
class FrameReceiver {
 public:
  /// A frame that has begun is given up if nothing more comes for so long. No device pauses for as long as that within
  /// a frame; a host that is held up (its receiving thread, or the kernel's worker that hands bytes on) seems to, and
  /// loses nothing by it. It matters only where noise looks like the beginning of a frame and bytes are few.
  static constexpr int64_t kGap_ns = 250'000'000;

  explicit FrameReceiver(Parser parser) : parser_(std::move(parser)) {}
  /// Another rate, or another line: what has begun is forgotten.
  void begin(uint32_t baud) {
    clock_.set_baud(baud);
    parser_.reset();
  }
  template <class Function>
  void receive(std::span<const uint8_t> bytes, int64_t now_ns, Function&& on_event) {
    const uint64_t skipped = parser_.skipped();
    if (parser_.begun() && now_ns - last_ns_ > kGap_ns) {
      parser_.abandon();
      parse(parser_, {}, on_event);
    }
    last_ns_ = now_ns;
    bytes_ += bytes.size();
    clock_.add(bytes_, now_ns);
    parse(parser_, bytes, on_event);
    if (parser_.skipped() != skipped) ++resyncs_;
  }
  /// When the first bit of the byte at that position came.
  int64_t began_ns(uint64_t position) const { return clock_.arrival_ns(position) - clock_.byte_ns(); }
  /// How often bytes came that belong to nothing.
  uint64_t resyncs() const { return resyncs_; }
  /// What else was counted.
  uint64_t damaged() const { return damaged_; }
  void count_damage() { ++damaged_; }

 private:
  Parser parser_;
  ByteClock clock_;
  int64_t last_ns_ = 0;
  uint64_t bytes_ = 0, resyncs_ = 0, damaged_ = 0;
};

}  // namespace takt
