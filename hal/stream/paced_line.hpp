// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <deque>
#include <vector>

#include "hal/stream/byte_stream.hpp"

namespace takt {

/// What a receiver of `to` baud makes of bytes that follow one another at `from` baud: it waits for a start bit, looks
/// at the middle of each of its own bits, and gives 0 where there is no stop bit, as a UART and its driver do.
std::vector<uint8_t> received_at_other_rate(std::span<const uint8_t> bytes, uint32_t from, uint32_t to);

/// The device's end of a line: bytes leave one after the other, as fast as the device's rate lets them. Where the other
/// side has set another rate, both sides get what a UART makes of that.
class PacedLine {
 public:
  explicit PacedLine(ByteStream& line) : line_(line) {}
  /// Of the device; 0: bytes need no time, whatever the other side has set.
  void set_baud(uint32_t baud) { baud_ = baud; }
  uint32_t baud() const { return baud_; }
  /// From `at_ns` on, but after all that was sent before.
  void send(int64_t at_ns, std::span<const uint8_t> bytes);
  /// When the last byte of all this has left.
  int64_t free_ns() const { return free_ns_; }
  /// What has not left yet never does.
  void interrupt(int64_t now_ns);
  /// Hands over what has left by now; what the other side cannot take is lost, as on a line.
  void run_to(int64_t now_ns);
  /// What the other side has said, at most 256 bytes at once.
  std::vector<uint8_t> receive();

 private:
  struct Piece {
    int64_t at_ns = 0;
    std::vector<uint8_t> bytes;
    size_t gone = 0;
  };
  std::vector<uint8_t> across(std::span<const uint8_t> bytes, bool to_host) const;

  ByteStream& line_;
  uint32_t baud_ = 0;
  std::deque<Piece> pieces_;
  int64_t free_ns_ = 0;
};

}  // namespace takt
