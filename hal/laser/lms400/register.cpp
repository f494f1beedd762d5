// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numbers>

#include "hal/laser/laser_node.hpp"
#include "hal/laser/lms400/driver.hpp"
#include "hal/laser/lms400/session.hpp"
#include "hal/laser/stream_laser.hpp"
#include "hal/stream/serial_port.hpp"
#include "hal/stream/tcp_connection.hpp"
#include "rt/msg/geometry.hpp"

namespace takt::hal {

namespace {

constexpr double kDegree = std::numbers::pi / 180;

double degrees(Settings& settings, const char* name, double fallback) {
  return settings.quantity(name, Dimension::angle, fallback * kDegree) / kDegree;
}

}  // namespace

NodeResult make_lms400(const DeviceConfig& config, Settings& settings, Devices&, const Clock& clock) {
  lms400::SessionSettings session;
  lms400::ScanConfiguration& scan = session.scan;
  scan.rate_hz = settings.quantity("scan_rate", Dimension::rate, scan.rate_hz);
  scan.step_deg = degrees(settings, "resolution", scan.step_deg);
  scan.fov_deg = degrees(settings, "fov", scan.fov_deg);
  scan.first_deg = 90 - scan.fov_deg / 2;
  session.max_range_m = settings.quantity("range", Dimension::length, session.max_range_m);
  if (!(scan.rate_hz >= 200 && scan.rate_hz <= 500) || !(scan.step_deg >= 0.0999 && scan.step_deg <= 1.0001) ||
      !(scan.fov_deg >= scan.step_deg && scan.fov_deg <= 70.0001) || !(session.max_range_m > 0))
    settings.fail("`scan_rate`, `resolution`, `fov` or `range` is out of range",
                  "scan_rate 200..500Hz, resolution 0.1..1deg, fov up to 70deg, range positive");
  const std::string address = settings.text("address", "");
  if (address.empty() == !settings.has("port"))
    settings.fail("give `address` or `port`",
                  "address: 192.168.0.1:2111 on a network, port: /dev/ttyUSB0 on a serial line");
  std::unique_ptr<ByteStream> stream;
  if (settings.has("port")) {
    session.baud = static_cast<uint32_t>(settings.count("baud", 115200, 9600, 1'000'000));
    stream = std::make_unique<SerialPort>(config.id, settings.path("port", true));
  } else {
    stream = std::make_unique<TcpConnection>(config.id, address);
  }
  const Transform mount = settings.mount("mount");
  if (settings.error()) return tl::unexpected(*settings.error());
  return std::make_unique<LaserNode>(std::make_unique<StreamLaser>(
      config.id, std::move(stream), std::make_unique<lms400::Session>(session), mount, clock));
}

}  // namespace takt::hal

namespace takt {

void register_lms400(hal::DeviceTypes& types) {
  using enum hal::SettingKind;
  types.add("laser_scanner",
            {"lms400", "a SICK LMS 400 on a network or a serial line", hal::hardware(hal::make_lms400)},
            {
                {"address", "lms400", text, false,
                 "numbers and port of its network interface, for instance 192.168.0.1:2111", true},
                {"port", "lms400", path, false, "serial line instead of `address`", true},
                {"baud", "lms400", count, false, "of the serial line; 115200", true},
                {"scan_rate", "lms400", rate, false, "200..500 Hz; 360"},
                {"fov", "lms400", angle, false, "up to 70deg, in the middle of what it can see; 70deg"},
                {"resolution", "lms400", angle, false, "0.1deg..1deg; 0.25deg"},
                {"range", "lms400", length, false, "larger distances are no return; 3m"},
            });
}

}  // namespace takt
