// SPDX-License-Identifier: Apache-2.0
// A driver and a double at both ends of one line, on virtual time: of memory, or one that the kernel makes.
#pragma once
#include <doctest/doctest.h>
#include <poll.h>

#include <deque>
#include <memory>
#include <vector>

#include "hal/device_double.hpp"
#include "hal/laser/stream_laser.hpp"

namespace takt::test {

/// What has gone through a line.
struct Flow {
  uint64_t wrote = 0, arrived = 0;
  bool open = false;  ///< somebody listens
  bool settled() const { return !open || arrived >= wrote; }
};

struct LineState {
  Flow to_host, to_device;
  std::deque<uint8_t> host_bytes, device_bytes;  ///< on their way, of a line of memory
  uint32_t baud = 9600, most_baud = 1'000'000;   ///< a rate above becomes 9600, as with a 16550
  bool plugged = false;
};

inline std::optional<size_t> take(std::deque<uint8_t>& from, std::span<uint8_t> into) {
  const size_t size = std::min(from.size(), into.size());
  std::copy_n(from.begin(), size, into.begin());
  from.erase(from.begin(), from.begin() + static_cast<ptrdiff_t>(size));
  return size;
}

class MemoryHostEnd final : public ByteStream {
 public:
  explicit MemoryHostEnd(LineState& line) : line_(line) {}
  DeviceResult open() override {
    line_.baud = 9600;
    line_.host_bytes.clear();
    if (line_.plugged) return {};
    return device_failure("laser", "not there", "plug it in");
  }
  void close() override {}
  std::optional<size_t> read(std::span<uint8_t> into) override {
    if (!line_.plugged) return std::nullopt;
    return take(line_.host_bytes, into);
  }
  std::optional<size_t> write(std::span<const uint8_t> bytes) override {
    if (!line_.plugged) return std::nullopt;
    line_.device_bytes.insert(line_.device_bytes.end(), bytes.begin(), bytes.end());
    return bytes.size();
  }
  void set_baud(uint32_t baud) override {
    line_.baud = baud <= line_.most_baud ? baud : 9600;
    line_.host_bytes.clear();
  }
  uint32_t baud() const override { return line_.baud; }

 private:
  LineState& line_;
};

class MemoryDeviceEnd final : public ByteStream {
 public:
  explicit MemoryDeviceEnd(LineState& line) : line_(line) {}
  DeviceResult open() override {
    line_.plugged = true;
    return {};
  }
  void close() override {
    line_.plugged = false;
    line_.host_bytes.clear();
    line_.device_bytes.clear();
  }
  std::optional<size_t> read(std::span<uint8_t> into) override { return take(line_.device_bytes, into); }
  std::optional<size_t> write(std::span<const uint8_t> bytes) override {
    if (line_.plugged) line_.host_bytes.insert(line_.host_bytes.end(), bytes.begin(), bytes.end());
    return bytes.size();
  }
  uint32_t baud() const override { return line_.baud; }

 private:
  LineState& line_;
};

/// Counts what goes through one end of a line of the kernel, whose bytes take a moment from end to end.
class CountedEnd final : public ByteStream {
 public:
  CountedEnd(std::unique_ptr<ByteStream> inner, Flow& out, Flow& in) : inner_(std::move(inner)), out_(out), in_(in) {}
  DeviceResult open() override {
    const DeviceResult opened = inner_->open();
    in_.arrived = in_.wrote;
    in_.open = opened.has_value();
    return opened;
  }
  void close() override {
    in_.open = false;
    inner_->close();
  }
  std::optional<size_t> read(std::span<uint8_t> into) override {
    const auto got = inner_->read(into);
    in_.arrived += got.value_or(0);
    return got;
  }
  std::optional<size_t> write(std::span<const uint8_t> bytes) override {
    const auto taken = inner_->write(bytes);
    out_.wrote += taken.value_or(0);
    return taken;
  }
  void set_baud(uint32_t baud) override {
    in_.arrived = in_.wrote;
    inner_->set_baud(baud);
  }
  uint32_t baud() const override { return inner_->baud(); }
  int descriptor() const override { return inner_->descriptor(); }

 private:
  std::unique_ptr<ByteStream> inner_;
  Flow &out_, &in_;
};

/// Both ends, and the time between them.
struct LaserLine {
  static constexpr int64_t kStep_ns = 1'000'000;
  LineState state;
  VirtualClock clock{7'000'000'000};
  std::unique_ptr<DeviceDouble> device;
  std::unique_ptr<StreamLaser> laser;
  std::vector<float> range_m;  ///< of the last read()

  void start() {
    REQUIRE(laser->open().has_value());
    REQUIRE(laser->start(clock.now_ns()).has_value());
    range_m.assign(laser->format().beams, -1.0f);
  }
  ScanReading read() { return laser->read(range_m, clock.now_ns(), INT64_MAX); }
  /// Until then both do what is due, in steps of a millisecond.
  void advance_to(int64_t end_ns) {
    while (clock.now_ns() < end_ns) {
      clock.advance_to(std::min(end_ns, clock.now_ns() + kStep_ns));
      device->run_to(clock.now_ns());
      wait_for(state.to_host, [&] { laser->step(); });
      wait_for(state.to_device, [&] { device->run_to(clock.now_ns()); });
    }
  }
  void advance_by(int64_t ns) { advance_to(clock.now_ns() + ns); }
  /// The driver is stopped meanwhile.
  void device_alone_for(int64_t ns) {
    clock.advance_to(clock.now_ns() + ns);
    device->run_to(clock.now_ns());
  }

 private:
  /// The kernel hands bytes over on a thread of its own.
  template <class Function>
  static void wait_for(const Flow& flow, Function&& receive) {
    receive();
    for (int tries = 0; !flow.settled(); ++tries) {
      REQUIRE(tries < 10'000);
      poll(nullptr, 0, tries < 100 ? 0 : 1);
      receive();
    }
  }
};

}  // namespace takt::test
