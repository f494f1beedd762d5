// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>

#include "hal/stream/byte_stream.hpp"
#include "hal/stream/descriptor.hpp"

namespace takt {

/// A serial line of this machine: 8 data bits, no parity, one stop bit, for this process alone. An adapter that was
/// pulled and put back may come under another number: name it by /dev/serial/by-id or by-path.
class SerialPort final : public ByteStream {
 public:
  /// `device_id` stands in errors; 9600 baud until set_baud().
  SerialPort(std::string device_id, std::filesystem::path path) : id_(std::move(device_id)), path_(std::move(path)) {}
  DeviceResult open() override;
  void close() override { port_.close(); }
  std::optional<size_t> read(std::span<uint8_t> into) override { return port_.read(into); }
  std::optional<size_t> write(std::span<const uint8_t> bytes) override { return port_.write(bytes); }
  void set_baud(uint32_t baud) override;
  uint32_t baud() const override;
  int descriptor() const override { return port_.get(); }

 private:
  std::string id_;
  std::filesystem::path path_;
  Descriptor port_;
};

}  // namespace takt
