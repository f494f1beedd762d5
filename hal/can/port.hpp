// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "hal/can/frame.hpp"
#include "rt/time/clock.hpp"

namespace takt::can {

/// What became of one call. None of them waits.
enum class PortStatus : uint8_t {
  ok,
  nothing,    ///< no frame is waiting
  malformed,  ///< something that is no classic frame with an 11-bit identifier was taken off the queue
  full,       ///< the queue to the bus is full: the frame was not sent
  down,       ///< the interface is down; the port works again when it is up
  gone,       ///< the interface or the other end is gone: close and open again
};

struct Reception {
  PortStatus status = PortStatus::nothing;
  Frame frame;
  int64_t stamp_ns = 0;  ///< when the kernel got it, on the runtime's clock
  /// The packet as it came, whatever the status says of it: at most that of an FD frame and a byte more, by which a
  /// longer one is seen to be longer.
  std::array<uint8_t, 73> packet;
  size_t packet_bytes = 0;
};

/// One end of a CAN bus: a raw socket of SocketCAN (`can0`), or, for tests and where the kernel has no CAN, a Unix
/// socket that carries the same 16 bytes a frame (`unix:PATH`), at which the device's end listens. One thread.
class Port {
 public:
  enum class End : uint8_t { host, device };

  Port(std::string interface, const Clock& clock, End end = End::host)
      : interface_(std::move(interface)), clock_(clock), end_(end) {}
  ~Port() { close(); }
  Port(const Port&) = delete;
  Port& operator=(const Port&) = delete;

  const std::string& interface() const { return interface_; }
  /// Before open(): FD frames are received as well; receive() calls them malformed, `packet` has them.
  void want_fd() { fd_ = true; }
  /// Only frames with these identifiers are received, at most 32, or every one if there are none; and all error frames.
  /// 0 or an errno. Open already: nothing changes.
  int open(std::span<const uint32_t> ids);
  void close();
  bool is_open() const { return descriptor_ >= 0 || listener_ >= 0; }

  Reception receive();
  PortStatus send(const Frame& frame);
  /// Frames that the kernel dropped because nobody took them in time; since construction.
  uint64_t overflows() const { return overflows_; }

 private:
  int open_can(std::span<const uint32_t> ids);
  int open_unix(std::string_view path);
  void accept_host();
  int64_t stamp_of(int64_t realtime_ns) const;

  std::string interface_;
  const Clock& clock_;
  End end_;
  bool fd_ = false;
  int descriptor_ = -1, listener_ = -1;
  uint64_t overflows_ = 0;
  uint32_t socket_overflows_ = 0;   ///< of the socket that is open, as the kernel counts them
  int64_t emptied_ns_ = INT64_MIN;  ///< what arrived before has been taken
};

/// What a person does about an errno of open().
std::string advice(const std::string& interface, int error);

}  // namespace takt::can
