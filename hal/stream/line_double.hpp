// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>

#include "hal/device_double.hpp"
#include "hal/stream/paced_line.hpp"

namespace takt {

/// What doubles at the end of a byte stream share: pace, and how bytes go wrong. What a device hears and says is up to
/// the class of the device.
class LineDouble : public DeviceDouble {
 public:
  explicit LineDouble(std::unique_ptr<ByteStream> line) : stream_(std::move(line)), line_(*stream_) {}
  DeviceResult plug_in() override { return stream_->open(); }
  void run_to(int64_t now_ns) final;
  std::span<const Misbehaviour> known() const override;
  void misbehave(Misbehaviour how) override;

 protected:
  virtual void hear(std::span<const uint8_t> bytes, int64_t now_ns) = 0;
  /// What the device does by itself until now.
  virtual void act(int64_t now_ns) = 0;
  /// One telegram, or one byte that stands alone.
  void say(int64_t at_ns, std::span<const uint8_t> bytes);
  Misbehaviour misbehaviour() const { return misbehaviour_; }
  PacedLine& line() { return line_; }

 private:
  std::unique_ptr<ByteStream> stream_;
  PacedLine line_;
  Misbehaviour misbehaviour_ = Misbehaviour::none;
  uint32_t noise_ = 1;
};

}  // namespace takt
