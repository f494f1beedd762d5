// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <optional>

#include "hal/can/end_to_end.hpp"
#include "hal/can/port.hpp"

namespace takt::can {

/// What arrived and was not used, and what was not sent.
struct StationCounters {
  uint64_t accepted = 0;
  uint64_t damaged = 0;       ///< no classic frame, or a CRC, counter, length or value that no sender makes
  uint64_t out_of_order = 0;  ///< the same again, or too many lost before it
  uint64_t gaps = 0;          ///< accepted although one or two were missing before
  uint64_t foreign = 0;       ///< identifiers that nobody asked for
  uint64_t unsent = 0;        ///< the queue to the bus was full, or the bus away
};

enum class Link : uint8_t { up, down, bus_off, gone };

/// A message that may be used.
struct Incoming {
  size_t message;                  ///< its place in the table
  std::span<const double> values;  ///< one per signal; until the next call
  int64_t stamp_ns;
};

/// One side of the conversation between the host and one device on a CAN bus, in the messages of a table: encodes and
/// protects what it sends, checks and decodes what it gets. Never waits, allocates only in its constructor and open().
/// One thread.
class Station {
 public:
  static constexpr size_t kMostMessages = 24;
  static constexpr size_t kMostRestarts = 5;  ///< of a controller in a minute (D-6)
  static constexpr int kMostFrames = 256;     ///< looked at without a pause: a babbling bus does not hold up a job

  /// `table` must outlive it.
  Station(std::string interface, const Clock& clock, std::span<const Message> table, Sender self);

  const std::string& interface() const { return port_.interface(); }
  /// 0 or an errno. What was learnt of the peer's counters is forgotten.
  int open();
  void close() { port_.close(); }

  /// The next message that may be used; nothing when all has been taken, or after kMostFrames.
  std::optional<Incoming> next();
  /// False if it could not be sent now. `values` as for encode.
  bool send(size_t message, std::span<const double> values);
  bool send(const Frame& frame);
  /// What `send` would send: counted and protected.
  Frame make(size_t message, std::span<const double> values);
  /// The frames of a message before were lost.
  void skip(size_t message, uint8_t frames) { senders_[message].skip(frames); }

  Link link() const { return link_ == Link::up && (bus_.state == BusState::off || restless()) ? Link::bus_off : link_; }
  /// The controller was restarted too often: it counts as off the bus for a minute, whatever it says.
  bool restless() const { return clock_.now_ns() < restless_until_ns_; }
  /// Frames that came faster than they were taken, by the controller or from the kernel's queue.
  uint64_t overflows() const { return bus_.overflows + port_.overflows(); }
  const BusWatch& bus() const { return bus_; }
  const StationCounters& counters() const { return counters_; }

 private:
  /// False if the frame is not to be used. Otherwise its values are in values_.
  bool accept(size_t message, const Frame& frame);

  void observe(const Frame& error);

  const Clock& clock_;
  Port port_;
  std::span<const Message> table_;
  Sender self_;
  Link link_ = Link::gone;
  BusWatch bus_;
  std::array<int64_t, kMostRestarts> restarted_ns_{};  ///< the last ones, a ring
  int64_t restless_until_ns_ = INT64_MIN;
  StationCounters counters_;
  int looked_at_ = 0;
  std::array<EndToEndSender, kMostMessages> senders_;
  std::array<EndToEndReceiver, kMostMessages> receivers_;
  std::array<std::array<double, kMostSignals>, kMostMessages> values_{};
};

}  // namespace takt::can
