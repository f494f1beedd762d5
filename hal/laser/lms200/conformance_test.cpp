// SPDX-License-Identifier: Apache-2.0
// The driver against its double, to the byte, in virtual time.
#include <doctest/doctest.h>

#include "tests/conformance/devices.hpp"
#include "tests/nanoseconds.hpp"
#include "tests/unit/lms200/rig.hpp"

using namespace takt;
using namespace takt::lms200;
using namespace takt::test;

TEST_CASE("the driver conforms, at every variant and rate, on a line of memory") {
  struct Case {
    SessionSettings settings;
    int64_t scan_ns;  ///< from scan to scan
  };
  const Case cases[] = {{{500000, {180, 50}, 0, true}, 2 * kTurn_ns}, {{500000, {180, 100}, 4, true}, kTurn_ns},
                        {{500000, {100, 25}, 6, true}, 4 * kTurn_ns}, {{500000, {180, 25}, 0, true}, 4 * kTurn_ns},
                        {{38400, {180, 50}, 0, true}, 16 * kTurn_ns}, {{38400, {180, 100}, 0, false}, 8 * kTurn_ns},
                        {{9600, {100, 100}, 0, true}, 17 * kTurn_ns}};
  for (const Case& c : cases) {
    INFO(c.settings.baud, " baud, ", c.settings.variant.angle_deg, " deg, ", c.settings.variant.step_cdeg, "/100 deg");
    Lms200Rig rig(c.settings);
    check_laser_scanner(*rig.laser, {kDeviceEpoch + 6 * kSecond, c.scan_ns, [&](int64_t to) { rig.advance_to(to); }});
    CHECK(rig.scanner->baud() == c.settings.baud);
    CHECK(rig.session->format().rate_hz == doctest::Approx(1e9 / static_cast<double>(c.scan_ns)));
  }
}

TEST_CASE("the driver conforms on a terminal of the kernel") {
  const TemporaryFolder folder;
  Lms200Rig rig({500000, {180, 50}, 0, true}, folder.path / "laser");
  CHECK_FALSE(rig.laser->start(kDeviceEpoch).has_value());  // not open yet
  check_laser_scanner(*rig.laser, {kDeviceEpoch + 4 * kSecond, 2 * kTurn_ns, [&](int64_t to) { rig.advance_to(to); }});
  CHECK(rig.scanner->baud() == 500000);
}
