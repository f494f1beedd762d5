// SPDX-License-Identifier: Apache-2.0
// The driver and the double, to the byte, on virtual time.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string_view>

#include "rt/msg/geometry.hpp"
#include "tests/conformance/devices.hpp"
#include "tests/has.hpp"
#include "tests/nanoseconds.hpp"
#include "tests/unit/lms200/rig.hpp"

using namespace takt;
using namespace takt::lms200;
using namespace takt::test;

namespace {

constexpr SessionSettings kFast{500000, {180, 50}, 0, true};

size_t count_of(const std::vector<ReadStatus>& all, ReadStatus one) {
  return static_cast<size_t>(std::count(all.begin(), all.end(), one));
}

}  // namespace

TEST_CASE("the first scan comes in the time that the driver says, whatever rate and stream a host left behind") {
  const uint32_t rates[] = {9600, 19200, 38400, 500000};
  for (const uint32_t left_at : rates)
    for (const uint32_t wanted : rates) {
      INFO("left at ", left_at, " baud, wanted ", wanted);
      Lms200Rig rig({left_at, {180, 50}, 0, true});
      rig.start();
      REQUIRE(rig.runs_within(60 * kSecond));
      rig.replace_host({wanted, {180, 100}, 4, true});
      rig.start();
      const int64_t from_ns = rig.clock.now_ns();
      REQUIRE(rig.runs_within(60 * kSecond));
      CHECK(rig.scanner->baud() == wanted);
      CHECK(rig.clock.now_ns() - from_ns <= rig.laser->starts_within_ns());
    }
}

TEST_CASE("scans have the values that were measured, and the stamp of their first beam") {
  for (const Variant variant : {Variant{180, 100}, Variant{180, 50}, Variant{180, 25}, Variant{100, 25}}) {
    Lms200Rig rig({500000, variant, 0, true});
    rig.start();
    REQUIRE(rig.runs_within(5 * kSecond));
    for (int k = 0; k < 20; ++k) {
      rig.advance_by(turns_of(variant) * kTurn_ns);
      const ScanReading reading = rig.read();
      REQUIRE(reading.status == ReadStatus::ok);
      // The mirror began a turn then, to what a step of this test leaves open.
      const int64_t into_turn = (reading.stamp_ns - kDeviceEpoch) % kTurn_ns;
      CHECK(std::min(into_turn, kTurn_ns - into_turn) <= LaserLine::kStep_ns);
      const ScanFormat format = rig.laser->format();
      for (size_t i = 0; i < format.beams; ++i) {
        // Beams between whole degrees are measured in the turns that follow.
        const auto turn = static_cast<int64_t>(i) % turns_of(variant);
        const double time_s = static_cast<double>(reading.stamp_ns + turn * kTurn_ns) * 1e-9;
        const double expected =
            static_cast<double>(tunnel_m(format.first_angle_rad + static_cast<double>(i) * format.step_rad, time_s));
        const double off = std::abs(static_cast<double>(rig.range_m[i]) - expected);
        CHECK(std::min(off, std::abs(off - 4)) < 0.003);
      }
    }
  }
}

TEST_CASE("half an hour on end: every scan arrives, once, at its time") {
  Lms200Rig rig(kFast);
  rig.start();
  REQUIRE(rig.runs_within(5 * kSecond));
  rig.advance_by(2 * kTurn_ns);
  ScanReading before = rig.read();
  const uint64_t damaged = rig.session->damaged(), sent = rig.scanner->scans_sent();
  int64_t worst_ns = 0;
  uint64_t arrived = 0;
  for (const int64_t end_ns = rig.clock.now_ns() + 1800 * kSecond; rig.clock.now_ns() < end_ns; ++arrived) {
    rig.advance_by(2 * kTurn_ns);
    const ScanReading reading = rig.read();
    REQUIRE(reading.status == ReadStatus::ok);
    REQUIRE(reading.scan_number == before.scan_number + 1);
    worst_ns = std::max(worst_ns, std::abs(reading.stamp_ns - before.stamp_ns - 2 * kTurn_ns));
    before = reading;
  }
  CHECK(arrived == rig.scanner->scans_sent() - sent);
  CHECK(rig.session->damaged() == damaged);
  CHECK(worst_ns <= LaserLine::kStep_ns);
  std::printf("LMS 200, 1800 s at 37.5 Hz: %llu scans, none lost or damaged; from stamp to stamp at most %.3f ms off\n",
              static_cast<unsigned long long>(arrived), static_cast<double>(worst_ns) * 1e-6);
}

TEST_CASE("a host that is held up, in the middle of a telegram too, loses no scan") {
  Lms200Rig rig(kFast);
  rig.start();
  REQUIRE(rig.runs_within(5 * kSecond));
  const uint64_t resyncs = rig.session->resyncs(), damaged = rig.session->damaged(),
                 before = rig.scanner->scans_sent() - rig.session->sweeps();
  for (int k = 0; k < 60; ++k) {
    rig.advance_by(17 * kMs);                       // to another place in the telegram each time
    rig.device_alone_for((1 + k % 20) * 10 * kMs);  // the driver gets all of it at once
    rig.advance_by(17 * kMs);
    rig.clock.advance_to(rig.clock.now_ns() + (1 + k % 20) * 10 * kMs);  // the line itself: what was due comes then
  }
  rig.advance_by(4 * kTurn_ns);
  CHECK(rig.session->resyncs() == resyncs);
  CHECK(rig.session->damaged() == damaged);
  CHECK(rig.session->missing() == 0);
  CHECK(rig.scanner->scans_sent() - rig.session->sweeps() <= before + 1);  // one may be on its way
}

TEST_CASE("what a host that died has left: a scanner that streams at another rate is found") {
  Lms200Rig first(kFast);
  first.start();
  REQUIRE(first.runs_within(5 * kSecond));
  for (const uint32_t baud : {500000u, 38400u, 9600u}) {
    auto talk = std::make_unique<Session>(SessionSettings{baud, {180, 100}, 0, true});
    first.session = talk.get();
    first.state.plugged = false;  // as if its process had been killed: its goodbye does not arrive
    first.laser.reset();
    first.state.plugged = true;
    first.laser = std::make_unique<StreamLaser>("laser", std::make_unique<MemoryHostEnd>(first.state), std::move(talk),
                                                Transform{}, first.clock);
    first.start();
    CHECK(first.runs_within(10 * kSecond));
    CHECK(first.scanner->baud() == baud);
  }
}

TEST_CASE("the memory of the scanner is written only where it differs") {
  for (const auto& [mode, writes] : {std::pair{uint8_t{0}, 0}, std::pair{uint8_t{4}, 1}}) {
    Lms200Rig rig({38400, {180, 50}, mode, true});
    rig.start();
    REQUIRE(rig.runs_within(5 * kSecond));
    CHECK(rig.scanner->writes() == writes);
    rig.laser->stop();
    rig.device_alone_for(kSecond);
    CHECK(rig.scanner->mode() == Mode::on_request);
    rig.start();
    REQUIRE(rig.runs_within(5 * kSecond));
    CHECK(rig.scanner->writes() == writes);
  }
}

TEST_CASE("a line that cannot do the rate: the highest it can is used, and told") {
  Lms200Rig rig(kFast);
  rig.state.most_baud = 115200;
  rig.start();
  REQUIRE(rig.runs_within(5 * kSecond));
  CHECK(rig.scanner->baud() == 38400);
  CHECK(has(rig.laser->trouble(), "does not do the rate"));
}

TEST_CASE("a scanner that misbehaves: what reads say, and that it comes back") {
  struct Case {
    Misbehaviour misbehaviour;
    ReadStatus status;  ///< of most reads meanwhile
    const char* trouble;
  };
  for (const Case& c : {Case{Misbehaviour::silent, ReadStatus::no_data, "does not answer"},
                        Case{Misbehaviour::garbage, ReadStatus::partial, "does not answer"},
                        Case{Misbehaviour::wrong_crc, ReadStatus::partial, "does not answer"},
                        Case{Misbehaviour::unplugged, ReadStatus::disconnected, "line is gone"}}) {
    INFO(static_cast<int>(c.misbehaviour));
    Lms200Rig rig(kFast);
    rig.start();
    REQUIRE(rig.runs_within(5 * kSecond));
    CHECK(std::string_view(rig.laser->trouble()).empty());
    CHECK(count_of(rig.statuses(30), ReadStatus::ok) == 30);
    rig.device->misbehave(c.misbehaviour);
    rig.statuses(30);
    const auto meanwhile = rig.statuses(30);
    CHECK(count_of(meanwhile, ReadStatus::ok) == 0);
    CHECK(count_of(meanwhile, c.status) > 0);
    CHECK(has(rig.laser->trouble(), c.trouble));
    rig.device->misbehave(Misbehaviour::none);
    CHECK(rig.runs_within(15 * kSecond));
    CHECK(rig.laser->restart(rig.clock.now_ns()));
    CHECK(count_of(rig.statuses(30), ReadStatus::ok) == 30);
    CHECK(std::string_view(rig.laser->trouble()).empty());
  }
}

TEST_CASE("a dazzled scanner gives no scans, since what it does not see would look like a free way; then it is back") {
  Lms200Rig rig(kFast);
  rig.start();
  REQUIRE(rig.runs_within(5 * kSecond));
  rig.device->misbehave(Misbehaviour::dazzled);
  rig.statuses(2);
  const auto meanwhile = rig.statuses(30);
  CHECK(count_of(meanwhile, ReadStatus::partial) == 30);
  CHECK(has(rig.laser->trouble(), "blinded"));
  CHECK(rig.laser->counts().damaged > 30);
  rig.device->misbehave(Misbehaviour::none);
  rig.statuses(2);
  CHECK(count_of(rig.statuses(30), ReadStatus::ok) == 30);
  CHECK(std::string_view(rig.laser->trouble()).empty());

  // Where so much may be blinded, scans come, and it is known which beams saw nothing.
  SessionSettings bold = kFast;
  bold.blinded_max = 0.5;
  Lms200Rig other(bold);
  other.start();
  REQUIRE(other.runs_within(5 * kSecond));
  other.device->misbehave(Misbehaviour::dazzled);
  other.statuses(2);
  CHECK(count_of(other.statuses(10), ReadStatus::ok) == 10);
  CHECK(std::count_if(other.range_m.begin(), other.range_m.end(), [](float range) { return std::isnan(range); }) ==
        doctest::Approx(361 / 3.0).epsilon(0.02));
  CHECK(other.range_m[0] > 0);
  CHECK(other.range_m[360] > 0);
}

TEST_CASE("a dirty pane: first told beside scans, then an error, whose kind is asked for; nothing is begun anew") {
  Lms200Rig rig(kFast);
  rig.start();
  REQUIRE(rig.runs_within(5 * kSecond));
  rig.device->misbehave(Misbehaviour::polluted);
  rig.statuses(2);
  CHECK(count_of(rig.statuses(20), ReadStatus::ok) == 20);
  CHECK(has(rig.laser->trouble(), "pane is dirty"));
  rig.statuses(15);
  const auto in_error = rig.statuses(30);
  CHECK(count_of(in_error, ReadStatus::ok) == 0);
  CHECK(count_of(in_error, ReadStatus::partial) == 30);
  CHECK(has(rig.laser->trouble(), "too dirty: clean it"));
  CHECK(rig.scanner->mode() == Mode::stream);
  rig.device->misbehave(Misbehaviour::none);
  rig.statuses(2);
  CHECK(count_of(rig.statuses(30), ReadStatus::ok) == 30);
  CHECK(std::string_view(rig.laser->trouble()).empty());
}

TEST_CASE("a scanner that falls to another rate is found again") {
  Lms200Rig rig(kFast);
  rig.start();
  REQUIRE(rig.runs_within(5 * kSecond));
  rig.device->misbehave(Misbehaviour::wrong_baud);
  rig.advance_by(20 * kMs);
  CHECK(rig.scanner->baud() == 19200);
  rig.statuses(20);
  REQUIRE(rig.runs_within(15 * kSecond));
  CHECK(rig.scanner->baud() == 500000);
}

TEST_CASE("a frozen scanner repeats itself, and an empty hall does not") {
  Lms200Rig rig(kFast);
  rig.start();
  REQUIRE(rig.runs_within(5 * kSecond));
  rig.advance_by(66 * kMs);
  const ScanReading well = rig.read();
  CHECK(well.status == ReadStatus::ok);
  CHECK_FALSE(well.repeated);
  rig.device->misbehave(Misbehaviour::frozen);
  rig.statuses(3);
  rig.advance_by(66 * kMs);
  const ScanReading frozen = rig.read();
  CHECK(frozen.status == ReadStatus::ok);
  CHECK(frozen.repeated);

  Lms200Rig hall(kFast,
                 [](const Sweep&, std::span<float> range_m) { std::fill(range_m.begin(), range_m.end(), 0.0f); });
  hall.start();
  REQUIRE(hall.runs_within(5 * kSecond));
  hall.statuses(3);
  hall.advance_by(66 * kMs);
  const ScanReading empty = hall.read();
  CHECK(empty.status == ReadStatus::ok);
  CHECK_FALSE(empty.repeated);
}

TEST_CASE("scans that are lost leave gaps in the numbers") {
  Lms200Rig rig(kFast);
  rig.start();
  REQUIRE(rig.runs_within(5 * kSecond));
  rig.advance_by(2 * kTurn_ns);
  const uint32_t before = rig.read().scan_number;
  rig.device->misbehave(Misbehaviour::wrong_crc);
  rig.advance_by(5 * 2 * kTurn_ns);
  rig.device->misbehave(Misbehaviour::none);
  rig.advance_by(2 * 2 * kTurn_ns);
  const ScanReading after = rig.read();
  REQUIRE(after.status == ReadStatus::ok);
  CHECK(after.scan_number >= before + 6);
  CHECK(after.scan_number <= before + 8);
}

TEST_CASE("interlaced: a quarter that is lost takes its whole scan with it") {
  Lms200Rig rig({500000, {180, 25}, 0, true});
  rig.start();
  REQUIRE(rig.runs_within(5 * kSecond));
  rig.advance_by(4 * kTurn_ns);
  const uint32_t before = rig.read().scan_number;
  rig.device->misbehave(Misbehaviour::wrong_crc);
  rig.advance_by(kTurn_ns);
  rig.device->misbehave(Misbehaviour::none);
  rig.advance_by(3 * 4 * kTurn_ns);
  const ScanReading after = rig.read();
  CHECK(after.status == ReadStatus::ok);
  CHECK(after.scan_number >= before + 2);
}

TEST_CASE("what a scanner refuses is told") {
  Session session(kFast);
  session.begin(0);
  const auto say = [&](const Telegram& telegram, int64_t at_ns) { session.receive(telegram.bytes(), at_ns); };
  const std::vector<uint8_t> ok{0}, no_variant{0, 180, 0, 50, 0}, type{'L', 'M', 'S', '2', '0', '0'};
  int64_t now_ns = 0;
  const auto obey = [&] {
    for (LineOrder order = session.next(now_ns); order.kind != LineOrder::Kind::wait; order = session.next(now_ns))
      if (order.kind == LineOrder::Kind::set_baud) session.line_has(order.baud);
  };
  obey();
  say(reply(Reply::mode, ok, 0x10), now_ns += kMs);
  obey();
  say(reply(Reply::type, type, 0x10), now_ns += kMs);
  obey();
  say(reply(Reply::variant, no_variant, 0x10), now_ns += kMs);
  CHECK(has(session.trouble(), "refuses field of view"));
  obey();
  say(reply(Reply::not_permitted, {}, 0x10), now_ns += kMs);
  CHECK(has(session.trouble(), "does not permit"));
}

TEST_CASE("a scanner that was switched on again is set up again") {
  Lms200Rig rig({38400, {180, 100}, 0, true});
  rig.start();
  REQUIRE(rig.runs_within(5 * kSecond));
  // As a person would who pulls its supply: it resets, and comes back at 9600 baud with another variant.
  rig.state.device_bytes.insert(rig.state.device_bytes.end(), {0x02, 0x00, 0x01, 0x00, 0x10, 0x34, 0x12});
  rig.advance_by(1200 * kMs);
  CHECK(rig.scanner->baud() == 9600);
  CHECK(rig.scanner->mode() == Mode::on_request);
  REQUIRE(rig.runs_within(15 * kSecond));
  CHECK(rig.scanner->baud() == 38400);
  CHECK(rig.scanner->variant() == Variant{180, 100});
}

TEST_CASE("any bytes at any time leave the session alive, and it answers the scanner again") {
  uint32_t random = 12345;
  const auto next = [&] { return (random = random * 1664525 + 1013904223) >> 16; };
  for (int round = 0; round < 20; ++round) {
    Lms200Rig rig(kFast);
    rig.start();
    rig.advance_by(static_cast<int64_t>(next() % 3000) * kMs);
    for (int burst = 0; burst < 50; ++burst) {
      for (uint32_t i = next() % 900; i > 0; --i) rig.state.host_bytes.push_back(static_cast<uint8_t>(next()));
      rig.advance_by(kMs);
      rig.read();
    }
    CHECK(rig.runs_within(20 * kSecond));
  }
}
