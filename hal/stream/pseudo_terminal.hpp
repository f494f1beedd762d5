// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>

#include "hal/stream/byte_stream.hpp"
#include "hal/stream/descriptor.hpp"

namespace takt {

/// The device's end of a serial line that exists in this machine only: a driver opens `path` as it would a serial port.
/// Closing it is pulling the plug. Nothing is lost while no driver has opened it, but for what the kernel cannot hold.
class PseudoTerminal final : public ByteStream {
 public:
  /// `path` becomes a link to the terminal; a link that is already there is replaced, nothing else is.
  explicit PseudoTerminal(std::filesystem::path path) : path_(std::move(path)) {}
  ~PseudoTerminal() override { close(); }
  DeviceResult open() override;
  void close() override;
  std::optional<size_t> read(std::span<uint8_t> into) override;
  std::optional<size_t> write(std::span<const uint8_t> bytes) override;
  /// What the driver's side has set.
  uint32_t baud() const override;
  int descriptor() const override { return master_.get(); }

 private:
  std::filesystem::path path_;
  Descriptor master_;
};

}  // namespace takt
