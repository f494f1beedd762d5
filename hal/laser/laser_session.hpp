// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "hal/laser/laser_scanner.hpp"

namespace takt {

/// A sweep as it came from a line.
struct ReceivedScan {
  int64_t stamp_ns = 0;        ///< of the first beam
  uint32_t scan_number = 0;    ///< by the device's own pace: a gap is a sweep that did not come
  std::vector<float> range_m;  ///< as LaserScanner::read gives them
};

/// What a session wants done to its line.
struct LineOrder {
  enum class Kind : uint8_t {
    wait,      ///< until `until_ns`, unless bytes come
    send,      ///< `bytes`, valid until the session is called again, `gap_ns` or more from one to the next
    set_baud,  ///< `baud`; the session is told what the line made of it
    reopen,    ///< the device does not answer: perhaps a new connection helps
  };
  Kind kind = Kind::wait;
  int64_t until_ns = 0;
  std::span<const uint8_t> bytes;
  int64_t gap_ns = 0;
  uint32_t baud = 0;

  static LineOrder wait(int64_t until_ns) { return {Kind::wait, until_ns, {}, 0, 0}; }
  static LineOrder send(std::span<const uint8_t> bytes, int64_t gap_ns = 0) {
    return {Kind::send, 0, bytes, gap_ns, 0};
  }
  static LineOrder set_baud(uint32_t baud) { return {Kind::set_baud, 0, {}, 0, baud}; }
  static LineOrder reopen() { return {Kind::reopen, 0, {}, 0, 0}; }
};

/// The conversation with a laser scanner, apart from I/O and clocks: told what came and when, it says what is to be
/// done. Allocates nothing after construction, and takes any bytes. One thread at a time.
class LaserSession {
 public:
  virtual ~LaserSession() = default;
  /// Always the same; sensor_in_robot is left out.
  virtual ScanFormat format() const = 0;
  /// From begin() to the first sweep, at most, with a scanner that is up and answers; 0: no longer than between sweeps.
  virtual int64_t starts_within_ns() const { return 0; }
  /// The line is open, for the first time or again; nothing is known of the device.
  virtual void begin(int64_t now_ns) = 0;
  /// Bytes that had come by now. Returns the newest sweep that they complete, valid until the next call, or null.
  virtual const ReceivedScan* receive(std::span<const uint8_t> bytes, int64_t now_ns) = 0;
  /// What to do now; to be asked again until it says `wait`.
  virtual LineOrder next(int64_t now_ns) = 0;
  /// After an order `set_baud`: the rate that the line has now, 0 where it has none.
  virtual void line_has(uint32_t baud) = 0;
  /// What to send so that the device falls silent.
  virtual LineOrder farewell() = 0;
  /// Whole sweeps that came, also those that receive() did not return for a newer one; since the first begin().
  virtual uint64_t sweeps() const = 0;
  /// Sweeps that the device made while it streamed, by its numbers or its pace, and that did not come whole; since the
  /// first begin(). By its pace one that was late may count until the next one has come in time.
  virtual uint64_t missing() const = 0;
  /// How often bytes came that belong to no telegram; since the first begin().
  virtual uint64_t resyncs() const = 0;
  /// Telegrams with a wrong checksum or length, and values that the device itself calls wrong; since the first begin().
  virtual uint64_t damaged() const = 0;
  /// Why no sweeps come, or what is not as it was asked for; a literal, empty if all is well.
  virtual const char* trouble() const = 0;
};

}  // namespace takt
