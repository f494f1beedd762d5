// SPDX-License-Identifier: Apache-2.0
// The driver and the double, to the byte, on virtual time.
#include <doctest/doctest.h>

#include <cmath>
#include <string_view>

#include "hal/laser/lms400/lms400_double.hpp"
#include "hal/laser/lms400/session.hpp"
#include "hal/stream/pseudo_terminal.hpp"
#include "hal/stream/serial_port.hpp"
#include "hal/stream/tcp_connection.hpp"
#include "hal/stream/tcp_listener.hpp"
#include "rt/msg/geometry.hpp"
#include "tests/conformance/devices.hpp"
#include "tests/conformance/laser_line.hpp"
#include "tests/has.hpp"
#include "tests/nanoseconds.hpp"
#include "tests/temporary_folder.hpp"

using namespace takt;
using namespace takt::lms400;
using namespace takt::test;

namespace {

/// A slope before the robot that comes nearer by 0.1 m in a second.
void slope(const Sweep& sweep, std::span<float> range_m) {
  for (size_t i = 0; i < range_m.size(); ++i) {
    const double angle = sweep.first_angle_rad + static_cast<double>(i) * sweep.step_rad;
    range_m[i] = static_cast<float>(3 - std::fmod(static_cast<double>(sweep.first_ns) * 1e-10, 2.0) + 0.1 * angle);
  }
}

struct Rig : LaserLine {
  Session* session = nullptr;
  Lms400Double* scanner = nullptr;

  explicit Rig(const SessionSettings& settings = {}) {
    build(settings, std::make_unique<MemoryHostEnd>(state), std::make_unique<MemoryDeviceEnd>(state));
  }
  Rig(const SessionSettings& settings, std::unique_ptr<ByteStream> host, std::unique_ptr<ByteStream> far) {
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
  void build(const SessionSettings& settings, std::unique_ptr<ByteStream> host, std::unique_ptr<ByteStream> far) {
    auto made = std::make_unique<Lms400Double>(std::move(far), slope, settings.baud, clock.now_ns());
    scanner = made.get();
    device = std::move(made);
    REQUIRE(device->plug_in().has_value());
    auto talk = std::make_unique<Session>(settings);
    session = talk.get();
    laser = std::make_unique<StreamLaser>("laser", std::move(host), std::move(talk), Transform{}, clock);
  }
};

LaserPace pace_of(Rig& rig, int64_t period_ns) {
  return {kDeviceEpoch + 2 * kSecond, period_ns, [&](int64_t to) { rig.advance_to(to); }};
}

}  // namespace

TEST_CASE("the driver conforms on a line of memory") {
  for (const auto& [rate_hz, step_deg] : {std::pair{250.0, 0.25}, std::pair{500.0, 0.5}, std::pair{200.0, 1.0}}) {
    SessionSettings settings;
    settings.scan.rate_hz = rate_hz;
    settings.scan.step_deg = step_deg;
    Rig rig(settings);
    check_laser_scanner(*rig.laser, pace_of(rig, std::llround(1e9 / rate_hz)));
    CHECK(rig.laser->format().beams == static_cast<uint32_t>(70 / step_deg));
  }
}

TEST_CASE("the driver conforms on a TCP connection") {
  TcpListener finds_a_port(0);
  REQUIRE(finds_a_port.open().has_value());
  const uint16_t port = finds_a_port.port();
  finds_a_port.close();
  SessionSettings settings;
  settings.scan.rate_hz = 250;
  Rig rig(settings, std::make_unique<TcpConnection>("laser", "127.0.0.1:" + std::to_string(port)),
          std::make_unique<TcpListener>(port));
  check_laser_scanner(*rig.laser, pace_of(rig, 4 * kMs));
}

TEST_CASE("the driver conforms on a terminal of the kernel, where the line carries some of the scans only") {
  const TemporaryFolder folder;
  SessionSettings settings;
  settings.scan.rate_hz = 250;
  settings.baud = 500000;  // 607 bytes: 12.1 ms, hence every fourth scan
  Rig rig(settings, std::make_unique<SerialPort>("laser", folder.path / "laser"),
          std::make_unique<PseudoTerminal>(folder.path / "laser"));
  rig.start();
  REQUIRE(rig.runs_within(3 * kSecond));
  rig.advance_by(16 * kMs);
  uint32_t number = rig.read().scan_number;
  for (int k = 0; k < 20; ++k) {
    rig.advance_by(16 * kMs);
    const ScanReading reading = rig.read();
    REQUIRE(reading.status == ReadStatus::ok);
    CHECK(reading.scan_number == number + 4);
    number = reading.scan_number;
  }
  CHECK(rig.laser->format().rate_hz == doctest::Approx(62.5));
}

TEST_CASE("scans have the values that were measured, and the stamp of their first beam") {
  SessionSettings settings;
  settings.scan.rate_hz = 250;
  Rig rig(settings);
  rig.start();
  REQUIRE(rig.runs_within(3 * kSecond));
  for (int k = 0; k < 20; ++k) {
    rig.advance_by(20 * kMs);
    const ScanReading reading = rig.read();
    REQUIRE(reading.status == ReadStatus::ok);
    std::vector<float> expected(rig.range_m.size());
    const ScanFormat format = rig.laser->format();
    slope({reading.stamp_ns, format.first_angle_rad, format.step_rad, 0}, expected);
    for (size_t i = 0; i < expected.size(); ++i) {
      const float seen = expected[i] > 3.0f ? 0.0f : expected[i];
      if (std::abs(expected[i] - 3.0f) > 0.001f) CHECK(rig.range_m[i] == doctest::Approx(seen).epsilon(0.001));
    }
  }
}

TEST_CASE("what a dead client left streaming is stopped first") {
  Rig rig;
  rig.start();
  REQUIRE(rig.runs_within(3 * kSecond));
  rig.state.plugged = false;  // as if its process had been killed: its goodbye does not arrive
  rig.laser.reset();
  rig.state.plugged = true;
  CHECK(rig.scanner->streaming());
  auto talk = std::make_unique<Session>(SessionSettings{});
  rig.session = talk.get();
  rig.laser = std::make_unique<StreamLaser>("laser", std::make_unique<MemoryHostEnd>(rig.state), std::move(talk),
                                            Transform{}, rig.clock);
  rig.start();
  CHECK(rig.runs_within(3 * kSecond));
  rig.laser->stop();
  rig.device_alone_for(10 * kMs);
  CHECK_FALSE(rig.scanner->streaming());
}

TEST_CASE("a scanner that misbehaves: what reads say, and that it comes back") {
  struct Case {
    Misbehaviour misbehaviour;
    ReadStatus status;  ///< seen meanwhile
  };
  for (const Case& c :
       {Case{Misbehaviour::silent, ReadStatus::no_data}, Case{Misbehaviour::garbage, ReadStatus::partial},
        Case{Misbehaviour::wrong_crc, ReadStatus::partial}, Case{Misbehaviour::unplugged, ReadStatus::disconnected}}) {
    INFO(static_cast<int>(c.misbehaviour));
    Rig rig;
    rig.start();
    REQUIRE(rig.runs_within(3 * kSecond));
    rig.device->misbehave(c.misbehaviour);
    rig.advance_by(20 * kMs);
    rig.read();
    bool seen = false;
    for (int k = 0; k < 40; ++k) {
      rig.advance_by(66 * kMs);
      const ReadStatus status = rig.read().status;
      CHECK(status != ReadStatus::ok);
      seen = seen || status == c.status;
    }
    CHECK(seen);
    CHECK_FALSE(std::string_view(rig.laser->trouble()).empty());
    rig.device->misbehave(Misbehaviour::none);
    CHECK(rig.runs_within(10 * kSecond));
    CHECK(std::string_view(rig.laser->trouble()).empty());
  }
}

TEST_CASE("a frozen scanner repeats itself") {
  Rig rig;
  rig.start();
  REQUIRE(rig.runs_within(3 * kSecond));
  rig.advance_by(66 * kMs);
  rig.device->misbehave(Misbehaviour::frozen);
  rig.advance_by(66 * kMs);
  const ScanReading frozen = rig.read();
  CHECK(frozen.status == ReadStatus::ok);
  CHECK(frozen.repeated);
}

TEST_CASE("a resolution that the scanner cannot do is told") {
  SessionSettings settings;
  settings.scan.rate_hz = 600;
  Rig rig(settings);
  rig.start();
  CHECK_FALSE(rig.runs_within(3 * kSecond));
  CHECK(has(rig.laser->trouble(), "refuses rate, resolution or field of view"));
}
