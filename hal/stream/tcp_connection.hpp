// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "hal/stream/byte_stream.hpp"
#include "hal/stream/descriptor.hpp"

namespace takt {

/// A connection to a device with a fixed address, "192.168.0.1:2111" or "[fe80::1]:2111": looking up a name could take
/// as long as it likes.
class TcpConnection final : public ByteStream {
 public:
  TcpConnection(std::string device_id, std::string address) : id_(std::move(device_id)), address_(std::move(address)) {}
  /// Waits for the other side's answer, at most 150 ms.
  DeviceResult open() override;
  void close() override { socket_.close(); }
  std::optional<size_t> read(std::span<uint8_t> into) override { return socket_.read(into); }
  std::optional<size_t> write(std::span<const uint8_t> bytes) override { return socket_.write(bytes); }
  int descriptor() const override { return socket_.get(); }

 private:
  std::string id_, address_;
  Descriptor socket_;
};

}  // namespace takt
