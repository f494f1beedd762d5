// SPDX-License-Identifier: Apache-2.0
// The driver of the camera head against its double, byte by byte through a socket, in virtual time.
#include "hal/head/can_head.hpp"

#include <doctest/doctest.h>

#include <string_view>

#include "hal/head/head_double.hpp"
#include "tests/nanoseconds.hpp"
#include "tests/unit/can/bench.hpp"

using namespace takt;
using namespace takt::head;

namespace {

using test::kMs;

struct Bench : test::CanBench<CanHead, HeadDouble> {
  ReadStatus status = ReadStatus::no_data;
  bool followed = false;

  explicit Bench(const HeadLimits& limits = kDefaultLimits) : CanBench(CanHeadSettings{{}, limits}) {}
  /// Jobs of a node every 20 ms: a disconnected device is restarted. Without a command the head holds.
  HeadReading jobs(int count, std::optional<HeadAngles> wanted = {}) {
    HeadReading reading;
    for (int k = 0; k < count; ++k) {
      pace(now() + test::kDevicePeriod);
      if (status == ReadStatus::disconnected && !driver.restart(now())) continue;
      if (wanted) followed = driver.command(wanted->pan_deg * kDegree, wanted->tilt_deg * kDegree, now());
      reading = driver.read(now(), INT64_MAX);
      status = reading.status;
    }
    return reading;
  }
  /// Started, homed and enabled.
  void start() {
    REQUIRE(driver.open().has_value());
    REQUIRE(driver.start(now()).has_value());
    jobs(100);
    REQUIRE(status == ReadStatus::ok);
    REQUIRE(device.state() == State::operation_enabled);
  }
};

}  // namespace

TEST_CASE("can head: what it asks the head for next") {
  const HeadAngles target{10, 5};
  HeadView view;
  CHECK(next_request(view, target).mode == Mode::disable);  // nothing known
  view.known = true;
  view.pan_deg = 3;
  view.tilt_deg = -1;
  CHECK(next_request(view, target).mode == Mode::home);
  view.homed = true;
  CHECK(next_request(view, target) == HeadRequest{Mode::position, {3, -1}});  // enabled where it stands
  view.state = State::operation_enabled;
  CHECK(next_request(view, target) == HeadRequest{Mode::position, target});
  CHECK(next_request(view, {}).mode == Mode::hold);
  for (auto set : {+[](HeadView& v) { v.emergency_stop = true; }, +[](HeadView& v) { v.fault = true; },
                   +[](HeadView& v) { v.emergency = kSupplyLow; }}) {
    HeadView stopped = view;
    set(stopped);
    CHECK(next_request(stopped, target).mode == Mode::disable);
  }
}

TEST_CASE("can head: homed and enabled without a jump; the eyelids open at the start and close at the stop") {
  Bench bench;
  CHECK(bench.device.left_lid_closed_percent() == 100);
  bench.start();
  CHECK(bench.device.homed());
  CHECK(bench.device.pan_rad() == 0);
  CHECK(bench.device.left_lid_closed_percent() == 0);
  CHECK(bench.device.station().counters().damaged == 0);
  CHECK(bench.driver.station().counters().damaged == 0);
  CHECK(bench.driver.station().counters().unsent == 0);
  bench.driver.stop();
  bench.pace(bench.now() + 600 * kMs);
  CHECK(bench.device.state() == State::switch_on_disabled);
  CHECK(bench.device.left_lid_closed_percent() == 100);
  CHECK(bench.device.emergency() == 0);  // told that the host goes, it misses nobody
}

TEST_CASE("can head: a lid is closed as long as each job says so") {
  Bench bench;
  bench.start();
  const auto say = [&](bool left, bool right) {
    for (int k = 0; k < 30; ++k) {  // 600 ms
      bench.driver.close_lids(left, right, bench.now());
      bench.jobs(1);
    }
  };
  say(true, false);
  CHECK(bench.device.left_lid_closed_percent() == 100);
  say(true, true);
  CHECK(bench.device.left_lid_closed_percent() == 100);
  say(false, true);
  CHECK(bench.device.left_lid_closed_percent() == 0);
  say(true, true);
  bench.jobs(30);  // nobody says anything
  CHECK(bench.device.left_lid_closed_percent() == 0);
}

TEST_CASE("can head: the limits are the narrower of the settings' and the head's own") {
  Bench bench({60 * kDegree, 80 * kDegree, 300 * kDegree, 20 * kDegree, 5000 * kDegree});
  bench.start();
  bench.jobs(100);  // 3 s from the start: all pages
  const HeadLimits limits = bench.driver.limits();
  CHECK(limits.pan_rad == doctest::Approx(60 * kDegree));
  CHECK(limits.tilt_rad == doctest::Approx(43 * kDegree));  // 45, less the margin
  CHECK(limits.pan_rad_s == doctest::Approx(200 * kDegree));
  CHECK(limits.tilt_rad_s == doctest::Approx(20 * kDegree));
  CHECK(limits.acceleration_rad_s2 == doctest::Approx(1000 * kDegree));
  CHECK_FALSE(bench.driver.command(61 * kDegree, 0, bench.now()));
}

TEST_CASE("can head: each misbehaviour is told, and it works again when it ends") {
  struct Case {
    Misbehaviour how;
    ReadStatus status;
  };
  for (const Case& c :
       {Case{Misbehaviour::silent, ReadStatus::no_data}, Case{Misbehaviour::unplugged, ReadStatus::disconnected},
        Case{Misbehaviour::wrong_crc, ReadStatus::partial}, Case{Misbehaviour::masquerade, ReadStatus::partial},
        Case{Misbehaviour::lost_frames, ReadStatus::no_data}, Case{Misbehaviour::repeated, ReadStatus::no_data},
        Case{Misbehaviour::garbage, ReadStatus::partial}, Case{Misbehaviour::no_heartbeat, ReadStatus::no_data},
        Case{Misbehaviour::bus_off, ReadStatus::disconnected}, Case{Misbehaviour::frozen, ReadStatus::ok}}) {
    CAPTURE(static_cast<int>(c.how));
    Bench bench;
    bench.start();
    bench.device.misbehave(c.how);
    bench.jobs(25);  // 500 ms
    CHECK(bench.status == c.status);
    bench.device.misbehave(Misbehaviour::none);
    bench.jobs(100, HeadAngles{20, 0});
    CHECK(bench.status == ReadStatus::ok);
    CHECK(bench.followed);
    CHECK(bench.device.pan_rad() == doctest::Approx(20 * kDegree).epsilon(1e-3));
  }
}

TEST_CASE("can head: a head that has to move and says the same again and again counts as frozen") {
  Bench bench;
  bench.start();
  CHECK_FALSE(bench.jobs(50, HeadAngles{20, 0}).repeated);  // it is there
  bench.device.misbehave(Misbehaviour::frozen);
  CHECK_FALSE(bench.jobs(50).repeated);  // nothing is asked of it
  CHECK_FALSE(bench.jobs(20, HeadAngles{-20, 0}).repeated);
  const HeadReading stuck = bench.jobs(20, HeadAngles{-20, 0});
  CHECK(stuck.status == ReadStatus::ok);
  CHECK(stuck.repeated);
  CHECK(std::string_view(bench.driver.trouble()).find("does not move") != std::string_view::npos);
  bench.device.misbehave(Misbehaviour::none);
  CHECK_FALSE(bench.jobs(50, HeadAngles{-20, 0}).repeated);
  CHECK(std::string_view(bench.driver.trouble()).empty());
}

TEST_CASE("can head: what it says of temperatures, supply and lids is told") {
  Bench bench;
  bench.start();
  const auto told = [&](const char* what) {
    bench.jobs(50);  // a second: each of these messages has come
    CAPTURE(bench.driver.trouble());
    return std::string_view(bench.driver.trouble()).find(what) != std::string_view::npos &&
           bench.status == ReadStatus::ok;
  };
  CHECK(std::string_view(bench.driver.trouble()).empty());
  bench.device.set_health(75, 24);
  CHECK(told("too hot"));
  bench.device.set_health(41, 19);
  CHECK(told("supply is low"));
  bench.device.set_health(41, 24);
  bench.device.jam_lids(true);
  CHECK(told("eyelid is stuck"));
  bench.device.jam_lids(false);
  bench.jobs(50);
  CHECK(std::string_view(bench.driver.trouble()).empty());
}

TEST_CASE("can head: a controller that is restarted again and again counts as off the bus until it has been steady") {
  Bench bench;
  bench.start();
  for (size_t restarts = 0; restarts < can::Station::kMostRestarts; ++restarts) {
    bench.device.misbehave(Misbehaviour::bus_off);
    bench.jobs(10);
    CHECK(bench.status == ReadStatus::disconnected);
    bench.device.misbehave(Misbehaviour::none);
    bench.jobs(100);
    CHECK(bench.status == ReadStatus::ok);
  }
  bench.device.misbehave(Misbehaviour::bus_off);
  bench.jobs(10);
  bench.device.misbehave(Misbehaviour::none);
  bench.jobs(100);
  CHECK(bench.status == ReadStatus::disconnected);
  CHECK(std::string_view(bench.driver.trouble()).find("again and again") != std::string_view::npos);
  bench.jobs(60 * 50);
  CHECK(bench.status == ReadStatus::ok);
  CHECK(std::string_view(bench.driver.trouble()).empty());
}

TEST_CASE("can head: an emergency stop is a refusal, not a loss; afterwards it goes on from where it stands") {
  Bench bench;
  bench.start();
  bench.jobs(5, HeadAngles{40, 0});
  bench.device.press_emergency_stop(true);
  bench.jobs(20, HeadAngles{40, 0});
  CHECK(bench.status == ReadStatus::ok);
  CHECK_FALSE(bench.followed);
  const double stands = bench.device.pan_rad();
  CHECK(stands < 39 * kDegree);
  bench.device.press_emergency_stop(false);
  bench.jobs(2);
  CHECK(bench.device.pan_rad() == doctest::Approx(stands).epsilon(1e-3));
  bench.jobs(50, HeadAngles{40, 0});
  CHECK(bench.followed);
  CHECK(bench.device.pan_rad() == doctest::Approx(40 * kDegree).epsilon(1e-3));
}

TEST_CASE("can head: a fault is a loss until a restart has reset it") {
  Bench bench;
  bench.start();
  bench.device.block_pan();
  bench.pace(bench.now() + test::kDevicePeriod);
  CHECK(bench.driver.read(bench.now(), INT64_MAX).status == ReadStatus::disconnected);
  CHECK(bench.driver.view().emergency == kFollowingError);
  CHECK_FALSE(bench.driver.restart(bench.now()));  // asks for the reset
  bench.pace(bench.now() + 100 * kMs);
  CHECK(bench.driver.restart(bench.now()));
  bench.jobs(20, HeadAngles{5, 0});
  CHECK(bench.followed);
}

TEST_CASE("can head: one that booted is homed again, and the old target is forgotten") {
  Bench bench;
  bench.start();
  bench.jobs(50, HeadAngles{30, 10});
  bench.device.reboot();
  bench.jobs(3);
  CHECK_FALSE(bench.device.homed());
  bench.jobs(100);
  CHECK(bench.status == ReadStatus::ok);
  CHECK(bench.device.homed());
  CHECK(bench.device.state() == State::operation_enabled);
  CHECK(bench.device.pan_rad() == 0);
}

TEST_CASE("can head: without set-points for 100 ms it stops, without heartbeats for 300 ms it says so") {
  Bench bench;
  bench.start();
  bench.jobs(3, HeadAngles{90, 0});
  bench.pace(bench.now() + 150 * kMs);
  CHECK(bench.device.state() == State::quick_stop);
  bench.pace(bench.now() + 400 * kMs);
  CHECK(bench.device.emergency() == kHeartbeatLost);
  CHECK(bench.device.pan_rad() < 60 * kDegree);
  bench.jobs(25);
  CHECK(bench.device.emergency() == 0);
  CHECK(bench.device.state() == State::operation_enabled);
  CHECK(bench.status == ReadStatus::ok);
}

TEST_CASE("can head: errors of opening name the interface and what to do") {
  VirtualClock clock;
  for (const char* interface : {"unix:/no/such/socket", "can99"}) {
    CanHead head("head", {.interface = interface}, clock);
    CHECK_FALSE(head.start(0).has_value());  // not open
    const auto opened = head.open();
    REQUIRE_FALSE(opened.has_value());
    CHECK_FALSE(opened.error().bad_input);
    CHECK(opened.error().what.find(interface) != std::string::npos);
    CHECK_FALSE(opened.error().fix.empty());
    CHECK_FALSE(head.restart(0));
  }
}
