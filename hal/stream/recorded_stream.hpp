// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>
#include <ostream>
#include <utility>

#include "hal/stream/byte_stream.hpp"

namespace takt {

/// A line whose every received byte is written down, too: by whoever reads, so for no real-time thread.
class RecordedStream final : public ByteStream {
 public:
  /// `into` must outlive it.
  RecordedStream(std::unique_ptr<ByteStream> line, std::ostream& into) : line_(std::move(line)), into_(into) {}
  DeviceResult open() override { return line_->open(); }
  void close() override { line_->close(); }
  std::optional<size_t> read(std::span<uint8_t> into) override {
    const auto got = line_->read(into);
    if (got) into_.write(reinterpret_cast<const char*>(into.data()), static_cast<std::streamsize>(*got));
    return got;
  }
  std::optional<size_t> write(std::span<const uint8_t> bytes) override { return line_->write(bytes); }
  void set_baud(uint32_t baud) override { line_->set_baud(baud); }
  uint32_t baud() const override { return line_->baud(); }
  int descriptor() const override { return line_->descriptor(); }

 private:
  std::unique_ptr<ByteStream> line_;
  std::ostream& into_;
};

}  // namespace takt
