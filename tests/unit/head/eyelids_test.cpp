// SPDX-License-Identifier: Apache-2.0
// The head's double as a device of its own: what the driver does not ask for is here, too.
#include <doctest/doctest.h>

#include "hal/head/head_double.hpp"
#include "tests/temporary_folder.hpp"

using namespace takt;
using namespace takt::head;

namespace {

/// A host that says what it is told to say.
struct Host {
  test::TemporaryFolder folder;
  std::string interface = "unix:" + (folder.path / "can").string();
  VirtualClock clock;
  HeadDouble device{interface, clock};
  can::Station station{interface, clock, messages(), can::Sender::host};

  Host() {
    REQUIRE(device.plug_in().has_value());
    REQUIRE(station.open() == 0);
    station.send(kNodeCommand, std::array{1.0, 16.0});
    pass(50);
  }
  void pass(int64_t ms) {
    station.send(kHostHeartbeat, std::array{5.0});
    clock.advance_to(clock.now_ns() + ms * 1'000'000);
    device.run_to(clock.now_ns());
  }
  void eyelids(EyelidAction action, double left, double right, double move_ms, double hold_ms, double repeat,
               double token) {
    station.send(kEyelidSetpoint,
                 std::array{static_cast<double>(action), left, right, move_ms, hold_ms, repeat, token});
  }
};

}  // namespace

TEST_CASE("head double: a blink runs once per token, however often it is told") {
  Host host;
  for (double token : {1.0, 1.0}) {  // the first frame of a message only begins the count
    host.eyelids(EyelidAction::position, 0, 0, 100, 0, 0, token);
    host.pass(200);
  }
  CHECK(host.device.left_lid_closed_percent() == 0);
  for (int k = 0; k < 20; ++k) {
    host.eyelids(EyelidAction::blink, 100, 100, 60, 40, 2, 2);
    host.pass(10);
    if (k == 7) CHECK(host.device.left_lid_closed_percent() == 100);
  }
  host.pass(200);
  CHECK(host.device.blinks() == 2);
  CHECK(host.device.left_lid_closed_percent() == 0);
  host.eyelids(EyelidAction::wink_right, 0, 100, 60, 40, 1, 3);
  host.pass(70);
  CHECK(host.device.left_lid_closed_percent() == 0);
  host.pass(100);
  CHECK(host.device.blinks() == 3);
}

TEST_CASE("head double: not before a start, and not after a reset") {
  Host host;
  while (host.station.next()) {
  }
  const auto accepted = host.station.counters().accepted;
  CHECK(accepted > 5);
  for (double command : {129.0, 2.0}) {  // reset, stop
    host.station.send(kNodeCommand, std::array{command, 16.0});
    host.pass(50);
    while (host.station.next()) {
    }
    const auto before = host.station.counters().accepted;
    host.pass(90);
    size_t others = 0;
    while (const auto incoming = host.station.next()) others += incoming->message != kHeartbeat;
    CHECK(others == 0);
    host.pass(200);
    while (host.station.next()) {
    }
    CHECK(host.station.counters().accepted > before);  // heartbeats go on
  }
}
