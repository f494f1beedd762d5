// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace takt::can {

/// What kind of frame a packet of a CAN socket is.
enum class FrameSort : uint8_t { standard, extended, remote, error, fd };
inline constexpr size_t kFrameSorts = 5;

struct DumpedFrame {
  FrameSort sort = FrameSort::standard;
  std::string text;
};

/// A packet of a CAN socket (`struct can_frame` or `struct canfd_frame`) as `candump -L` writes and `canplayer` reads
/// it:
///
///     190#E841B50BE6FB0E02    11 bits        123#R           remote; R3: with a length
///     18FEF100#010203         29 bits        321##1AAAA      FD, flags 1
///     20000004#0000000000000000              an error frame of the controller
///
/// Nothing for a packet that is none of both, or has a length that no frame has. Any thread.
std::optional<DumpedFrame> candump_text(std::span<const uint8_t> packet);

}  // namespace takt::can
