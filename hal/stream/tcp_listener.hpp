// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>

#include "hal/stream/byte_stream.hpp"
#include "hal/stream/descriptor.hpp"

namespace takt {

/// The device's end of connections on this machine's loopback, one at a time: a new one takes the place of the one
/// before. Closing it is pulling the plug.
class TcpListener final : public ByteStream {
 public:
  /// `port` 0: the kernel chooses one, which stays the same from then on.
  explicit TcpListener(uint16_t port) : port_(port) {}
  DeviceResult open() override;
  void close() override;
  std::optional<size_t> read(std::span<uint8_t> into) override;
  std::optional<size_t> write(std::span<const uint8_t> bytes) override;
  int descriptor() const override { return client_ ? client_.get() : listener_.get(); }
  uint16_t port() const { return port_; }

 private:
  uint16_t port_;
  Descriptor listener_, client_;
};

}  // namespace takt
