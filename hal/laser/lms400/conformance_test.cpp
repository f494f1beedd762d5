// SPDX-License-Identifier: Apache-2.0
// The driver against its double, to the byte, in virtual time.
#include <doctest/doctest.h>

#include "hal/stream/pseudo_terminal.hpp"
#include "hal/stream/serial_port.hpp"
#include "hal/stream/tcp_connection.hpp"
#include "hal/stream/tcp_listener.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/lms400/rig.hpp"

using namespace takt;
using namespace takt::lms400;
using namespace takt::test;

TEST_CASE("the driver conforms on a line of memory") {
  for (const auto& [rate_hz, step_deg] : {std::pair{250.0, 0.25}, std::pair{500.0, 0.5}, std::pair{200.0, 1.0}}) {
    SessionSettings settings;
    settings.scan.rate_hz = rate_hz;
    settings.scan.step_deg = step_deg;
    Lms400Rig rig(settings);
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
  Lms400Rig rig(settings, std::make_unique<TcpConnection>("laser", "127.0.0.1:" + std::to_string(port)),
                std::make_unique<TcpListener>(port));
  check_laser_scanner(*rig.laser, pace_of(rig, 4 * kMs));
}

TEST_CASE("the driver conforms on a terminal of the kernel, where the line carries some of the scans only") {
  const TemporaryFolder folder;
  SessionSettings settings;
  settings.scan.rate_hz = 250;
  settings.baud = 500000;  // 607 bytes: 12.1 ms, hence every fourth scan
  Lms400Rig rig(settings, std::make_unique<SerialPort>("laser", folder.path / "laser"),
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
