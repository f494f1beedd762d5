// SPDX-License-Identifier: Apache-2.0
// The driver and the double, to the byte, on virtual time.
#include <doctest/doctest.h>

#include <cmath>
#include <string_view>

#include "tests/has.hpp"
#include "tests/unit/lms400/rig.hpp"

using namespace takt;
using namespace takt::lms400;
using namespace takt::test;

TEST_CASE("scans have the values that were measured, and the stamp of their first beam") {
  SessionSettings settings;
  settings.scan.rate_hz = 250;
  Lms400Rig rig(settings);
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
  Lms400Rig rig;
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
    Lms400Rig rig;
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
  Lms400Rig rig;
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
  Lms400Rig rig(settings);
  rig.start();
  CHECK_FALSE(rig.runs_within(3 * kSecond));
  CHECK(has(rig.laser->trouble(), "refuses rate, resolution or field of view"));
}
