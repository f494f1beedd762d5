// SPDX-License-Identifier: Apache-2.0
#include "hal/drivers/sick_lasers.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hal/laser/lms200/session.hpp"
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

lms200::Variant variant_of(Settings& settings) {
  const auto whole = [](double value) { return static_cast<uint16_t>(std::clamp(std::round(value), 0.0, 65535.0)); };
  const double fov_deg = degrees(settings, "fov", 180), step_deg = degrees(settings, "resolution", 0.5);
  const lms200::Variant variant{whole(fov_deg), whole(100 * step_deg)};
  if (!lms200::valid(variant) || std::abs(fov_deg - variant.angle_deg) > 1e-6 ||
      std::abs(100 * step_deg - variant.step_cdeg) > 1e-6)
    settings.fail("`fov` and `resolution` are no pair that the scanner has",
                  "fov 100deg or 180deg, resolution 1deg, 0.5deg or 0.25deg");
  return variant;
}

/// Of the measuring modes with fields (devices.md 1.7), the one that reaches so far.
void set_range(Settings& settings, lms200::SessionSettings& session) {
  const double range_m = settings.quantity("range", Dimension::length, 8.0);
  if (range_m == 8) session.measuring_mode = 0x00;
  else if (range_m == 16) session.measuring_mode = 0x04;
  else if (range_m == 32) session.measuring_mode = 0x06;
  else if (range_m == 80) session.millimetres = false;
  else settings.fail("`range` is no range that the scanner has", "use 8m, 16m, 32m, or 80m (in centimetres)");
}

}  // namespace

std::unique_ptr<LaserScanner> make_lms200(const DeviceConfig& config, Settings& settings, const Clock& clock) {
  lms200::SessionSettings session;
  session.variant = variant_of(settings);
  set_range(settings, session);
  session.baud = static_cast<uint32_t>(settings.count("baud", session.baud, 9600, 500000));
  if (std::find(lms200::kBauds.begin(), lms200::kBauds.end(), session.baud) == lms200::kBauds.end())
    settings.fail("`baud` is no rate that the scanner has", "use 9600, 19200, 38400, or 500000 on an RS-422 line");
  session.blinded_max = settings.quantity("blinded_max", Dimension::number, session.blinded_max);
  if (!(session.blinded_max >= 0 && session.blinded_max <= 1))
    settings.fail("`blinded_max` is no share of the beams", "use 0..1, for instance 0.1");
  if (lms200::interlaced(session.variant) && session.baud != 500000)
    settings.fail("180deg at 0.25deg is sent in four parts, too fast for `baud`",
                  "use baud 500000, or resolution 0.5deg");
  const auto port = settings.path("port", true);
  const Transform mount = settings.mount("mount");
  if (settings.error()) return nullptr;
  return std::make_unique<StreamLaser>(config.id, std::make_unique<SerialPort>(config.id, port),
                                       std::make_unique<lms200::Session>(session), mount, clock);
}

std::unique_ptr<LaserScanner> make_lms400(const DeviceConfig& config, Settings& settings, const Clock& clock) {
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
  if (settings.error()) return nullptr;
  return std::make_unique<StreamLaser>(config.id, std::move(stream), std::make_unique<lms400::Session>(session), mount,
                                       clock);
}

}  // namespace takt::hal
