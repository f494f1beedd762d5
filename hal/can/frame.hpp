// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace takt::can {

/// A classic CAN frame with an 11-bit identifier, or an error frame of SocketCAN (kErrorFlag in `id`). Bytes beyond
/// `length` are 0.
struct Frame {
  uint32_t id = 0;
  uint8_t length = 0;  ///< 0..8
  std::array<uint8_t, 8> data{};
  friend bool operator==(const Frame&, const Frame&) = default;
};
constexpr uint32_t kErrorFlag = 0x20000000;

/// `struct can_frame`: identifier in host order, length, three bytes of padding, eight of data.
using WireFrame = std::array<uint8_t, 16>;
WireFrame to_wire(const Frame& frame);
/// Nothing for a number of bytes or a length that no classic frame has, and for remote or extended frames.
std::optional<Frame> from_wire(std::span<const uint8_t> bytes);

enum class BusState : uint8_t { active, warning, passive, off };

/// What the controller says of the bus, from its error frames (linux/can/error.h). No allocation.
struct BusWatch {
  BusState state = BusState::active;
  uint8_t transmit_errors = 0, receive_errors = 0;  ///< the controller's own counters, as last told
  uint64_t error_frames = 0, overflows = 0, unacknowledged = 0, restarts = 0;

  void observe(const Frame& error);
};

}  // namespace takt::can
