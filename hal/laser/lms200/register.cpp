// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numbers>

#include "hal/laser/laser_node.hpp"
#include "hal/laser/lms200/driver.hpp"
#include "hal/laser/lms200/session.hpp"
#include "hal/laser/stream_laser.hpp"
#include "hal/stream/serial_port.hpp"
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

/// Of the measuring modes with fields (D-1.7), the one that reaches so far.
void set_range(Settings& settings, lms200::SessionSettings& session) {
  const double range_m = settings.quantity("range", Dimension::length, 8.0);
  if (range_m == 8) session.measuring_mode = 0x00;
  else if (range_m == 16) session.measuring_mode = 0x04;
  else if (range_m == 32) session.measuring_mode = 0x06;
  else if (range_m == 80) session.millimetres = false;
  else settings.fail("`range` is no range that the scanner has", "use 8m, 16m, 32m, or 80m (in centimetres)");
}

}  // namespace

NodeResult make_lms200(const DeviceConfig& config, Settings& settings, Devices&, const Clock& clock) {
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
  if (settings.error()) return tl::unexpected(*settings.error());
  return std::make_unique<LaserNode>(
      std::make_unique<StreamLaser>(config.id, std::make_unique<SerialPort>(config.id, port),
                                    std::make_unique<lms200::Session>(session), mount, clock));
}

}  // namespace takt::hal

namespace takt {

void register_lms200(hal::DeviceTypes& types) {
  using enum hal::SettingKind;
  types.add("laser_scanner", {"lms200", "a SICK LMS 200 on a serial line", hal::hardware(hal::make_lms200)},
            {
                {"port", "lms200", path, true, "serial line, for instance /dev/ttyS1", true},
                {"baud", "lms200", count, false, "9600, 19200, 38400 or 500000; 38400"},
                {"fov", "lms200", angle, false, "100deg or 180deg; 180deg"},
                {"resolution", "lms200", angle, false, "1deg, 0.5deg or 0.25deg; 0.5deg"},
                {"range", "lms200", length, false, "8m, 16m, 32m or 80m; 8m"},
                {"blinded_max", "lms200", number, false, "share of blinded beams above which a scan is refused; 0.1"},
            });
}

}  // namespace takt
