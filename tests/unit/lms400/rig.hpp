// SPDX-License-Identifier: Apache-2.0
// A driver and a double of an LMS 400, at the ends of one line.
#pragma once
#include <doctest/doctest.h>

#include <cmath>

#include "hal/laser/lms400/lms400_double.hpp"
#include "hal/laser/lms400/session.hpp"
#include "rt/msg/geometry.hpp"
#include "tests/conformance/devices.hpp"
#include "tests/conformance/laser_line.hpp"
#include "tests/nanoseconds.hpp"

namespace takt::test {

/// A slope before the robot that comes nearer by 0.1 m in a second.
inline void slope(const Sweep& sweep, std::span<float> range_m) {
  for (size_t i = 0; i < range_m.size(); ++i) {
    const double angle = sweep.first_angle_rad + static_cast<double>(i) * sweep.step_rad;
    range_m[i] = static_cast<float>(3 - std::fmod(static_cast<double>(sweep.first_ns) * 1e-10, 2.0) + 0.1 * angle);
  }
}

struct Lms400Rig : LaserLine {
  lms400::Session* session = nullptr;
  lms400::Lms400Double* scanner = nullptr;

  explicit Lms400Rig(const lms400::SessionSettings& settings = {}) {
    build(settings, std::make_unique<MemoryHostEnd>(state), std::make_unique<MemoryDeviceEnd>(state));
  }
  Lms400Rig(const lms400::SessionSettings& settings, std::unique_ptr<ByteStream> host,
            std::unique_ptr<ByteStream> far) {
    build(settings, std::make_unique<CountedEnd>(std::move(host), state.to_device, state.to_host),
          std::make_unique<CountedEnd>(std::move(far), state.to_host, state.to_device));
  }
  bool runs_within(int64_t ns) {
    for (const int64_t end_ns = clock.now_ns() + ns; clock.now_ns() < end_ns;) {
      advance_by(10 * kMs);
      if (session->running() && read().status == ReadStatus::ok) return true;
    }
    return false;
  }

 private:
  void build(const lms400::SessionSettings& settings, std::unique_ptr<ByteStream> host,
             std::unique_ptr<ByteStream> far) {
    auto made = std::make_unique<lms400::Lms400Double>(std::move(far), slope, settings.baud, clock.now_ns());
    scanner = made.get();
    device = std::move(made);
    REQUIRE(device->plug_in().has_value());
    auto talk = std::make_unique<lms400::Session>(settings);
    session = talk.get();
    laser = std::make_unique<StreamLaser>("laser", std::move(host), std::move(talk), Transform{}, clock);
  }
};

inline LaserPace pace_of(Lms400Rig& rig, int64_t period_ns) {
  return {kDeviceEpoch + 2 * kSecond, period_ns, [&](int64_t to) { rig.advance_to(to); }};
}

}  // namespace takt::test
