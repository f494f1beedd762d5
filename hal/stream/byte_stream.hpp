// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <optional>
#include <span>

#include "hal/device.hpp"

namespace takt {

/// Bytes to and from a device, whatever carries them. Nothing here waits, but for open() of a connection (see there).
/// One thread at a time.
class ByteStream {
 public:
  ByteStream() = default;
  ByteStream(const ByteStream&) = delete;
  ByteStream& operator=(const ByteStream&) = delete;
  virtual ~ByteStream() = default;

  /// Claims the line; again after it was lost.
  virtual DeviceResult open() = 0;
  virtual void close() = 0;
  /// Takes what has arrived, at most into.size() bytes. Nothing at all: the line is lost until open() succeeds again.
  virtual std::optional<size_t> read(std::span<uint8_t> into) = 0;
  /// How many of the bytes were taken, from the first on. Nothing at all: as read().
  virtual std::optional<size_t> write(std::span<const uint8_t> bytes) = 0;
  /// Asks for a rate in both directions, and forgets what arrived before. What the line really has then says baud().
  virtual void set_baud(uint32_t) {}
  /// Bits per second, ten of them a byte; 0: the line has no rate.
  virtual uint32_t baud() const { return 0; }
  /// For poll(): readable once bytes have arrived; -1: there is none.
  virtual int descriptor() const { return -1; }
};

/// Time that a byte takes, start and stop bit included; 0 without a rate.
constexpr int64_t byte_time_ns(uint32_t baud) { return baud == 0 ? 0 : 10'000'000'000 / int64_t{baud}; }

}  // namespace takt
