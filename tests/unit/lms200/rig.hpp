// SPDX-License-Identifier: Apache-2.0
// A driver and a double of an LMS 200, at the ends of one line.
#pragma once
#include <cmath>

#include "hal/laser/lms200/lms200_double.hpp"
#include "hal/laser/lms200/session.hpp"
#include "hal/stream/pseudo_terminal.hpp"
#include "hal/stream/serial_port.hpp"
#include "rt/msg/geometry.hpp"
#include "tests/conformance/laser_line.hpp"
#include "tests/temporary_folder.hpp"

namespace takt::test {

/// Metres that a scanner sees which stands in a tunnel: other ones for each beam, growing by 1 m in a second.
inline float tunnel_m(double angle_rad, double time_s) {
  return static_cast<float>(2 + 0.5 * std::cos(angle_rad) + std::fmod(time_s, 4.0));
}

inline RangeSource tunnel() {
  return [](const Sweep& sweep, std::span<float> range_m) {
    for (size_t i = 0; i < range_m.size(); ++i)
      range_m[i] = tunnel_m(sweep.first_angle_rad + static_cast<double>(i) * sweep.step_rad,
                            static_cast<double>(sweep.first_ns) * 1e-9);
  };
}

struct Lms200Rig : LaserLine {
  lms200::Session* session = nullptr;
  lms200::Lms200Double* scanner = nullptr;

  explicit Lms200Rig(const lms200::SessionSettings& settings, RangeSource source = tunnel()) {
    build(settings, std::move(source), std::make_unique<MemoryHostEnd>(state),
          std::make_unique<MemoryDeviceEnd>(state));
  }
  /// Over a terminal of the kernel at that path.
  Lms200Rig(const lms200::SessionSettings& settings, const std::filesystem::path& path) {
    build(settings, tunnel(),
          std::make_unique<CountedEnd>(std::make_unique<SerialPort>("laser", path), state.to_device, state.to_host),
          std::make_unique<CountedEnd>(std::make_unique<PseudoTerminal>(path), state.to_host, state.to_device));
  }
  /// The host dies in the middle of what it does, and another one comes.
  void replace_host(const lms200::SessionSettings& settings) {
    dead_host = std::move(laser);
    connect_host(settings, std::make_unique<MemoryHostEnd>(state));
  }
  /// Until scans come, at most so long.
  bool runs_within(int64_t ns) {
    for (const int64_t end_ns = clock.now_ns() + ns; clock.now_ns() < end_ns;) {
      advance_by(10'000'000);
      if (session->running() && read().status == ReadStatus::ok) return true;
    }
    return false;
  }
  /// Statuses of `count` reads, 15 a second.
  std::vector<ReadStatus> statuses(int count) {
    std::vector<ReadStatus> all;
    for (int i = 0; i < count; ++i) {
      advance_by(66'666'667);
      all.push_back(read().status);
    }
    return all;
  }

 private:
  void build(const lms200::SessionSettings& settings, RangeSource source, std::unique_ptr<ByteStream> host,
             std::unique_ptr<ByteStream> far) {
    auto made = std::make_unique<lms200::Lms200Double>(std::move(far), std::move(source), clock.now_ns());
    scanner = made.get();
    device = std::move(made);
    REQUIRE(device->plug_in().has_value());
    connect_host(settings, std::move(host));
  }
  void connect_host(const lms200::SessionSettings& settings, std::unique_ptr<ByteStream> line) {
    auto talk = std::make_unique<lms200::Session>(settings);
    session = talk.get();
    laser = std::make_unique<StreamLaser>("laser", std::move(line), std::move(talk), Transform{}, clock);
  }

  std::unique_ptr<StreamLaser> dead_host;  ///< says and hears nothing
};

}  // namespace takt::test
