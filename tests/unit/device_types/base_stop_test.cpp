// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "hal/base/base_node.hpp"
#include "rt/msg/ace/stop_command.hpp"
#include "rt/msg/velocity_command.hpp"
#include "rt/sched/port_access.hpp"
#include "rt/testing.hpp"
#include "tests/conformance/fake_writer.hpp"

using namespace takt;

namespace {

/// Notes the last command.
class NotingBase final : public MobileBase {
 public:
  StampLaw stamp_law(const JobTimes&) const override { return {}; }
  DeviceResult open() override { return {}; }
  void close() override {}
  DeviceResult start(int64_t) override { return {}; }
  void stop() override {}
  BaseLimits limits() const override { return {1.4, 1.35, 1.2}; }
  BaseReading read(int64_t wanted_ns, int64_t) override {
    return {ReadStatus::ok, wanted_ns, 0, 0, 0, speed_m_s, turn_rad_s, 0, false};
  }
  bool command(double speed, double turn, int64_t) override {
    speed_m_s = speed, turn_rad_s = turn, ++commands;
    return true;
  }
  double speed_m_s = -1, turn_rad_s = -1;
  int commands = 0;
};

struct BaseFixture {
  NotingBase* base = new NotingBase;  // owned by the node
  BaseNode node{std::unique_ptr<MobileBase>(base)};
  InputPort& velocity = *node.inputs()[0];
  InputPort& stop = *node.inputs()[1];
  test::FakeWriter writer{*node.outputs()[0]};
  test::Box<VelocityCommand> wanted;
  test::Box<StopCommand> command;
  VirtualClock clock;

  explicit BaseFixture(bool with_stop) {
    REQUIRE(velocity.name() == "velocity");
    REQUIRE(stop.name() == "stop");
    PortAccess::connect(velocity, {});
    if (with_stop) PortAccess::connect(stop, {});
    Setup setup{clock, ".", {}, 1, Rate{15, 1}};
    node.setup(setup);
    node.start(0);
    wanted->speed_m_s = 0.7;
    wanted->turn_rad_s = 0.2;
    test::latch(velocity, wanted, 0, 1);
  }
  void job(std::string_view mode = "full") {
    base->speed_m_s = base->turn_rad_s = -1;
    base->commands = 0;
    PortAccess::reset(*node.outputs()[0]);
    Job job(clock, 0, 0, 66'000'000, 0, mode);
    node.run(job);
    CHECK(PortAccess::sent(*node.outputs()[0]));  // odometry goes on, whatever the command
  }
  bool drives() const { return base->commands == 1 && base->speed_m_s == 0.7 && base->turn_rad_s == 0.2; }
  bool halts() const { return base->commands == 1 && base->speed_m_s == 0 && base->turn_rad_s == 0; }
};

}  // namespace

TEST_CASE("base: without a stop input the velocity is passed on") {
  BaseFixture f(false);
  f.job();
  CHECK(f.drives());
}

TEST_CASE("base: a stop command makes the velocity zero, and silence stops as well") {
  BaseFixture f(true);
  f.job();
  CHECK(f.halts());  // connected, but nothing has come yet
  test::latch(f.stop, f.command, 0, 1);
  f.job();
  CHECK(f.drives());
  for (const uint32_t reason : {stop_reason::obstacle, stop_reason::line, stop_reason::scan_lost,
                                stop_reason::line_lost, stop_reason::safe_stop}) {
    f.command->reasons = reason;
    f.job();
    CHECK(f.halts());
  }
  f.command->reasons = 0;
  f.job();
  CHECK(f.drives());
  PortAccess::set_held(f.stop, 1, true, 0);  // older than the edge allows
  f.job();
  CHECK(f.halts());
}

TEST_CASE("base: a stop is commanded also where there is no velocity, which alone would only wait for the watchdog") {
  BaseFixture f(true);
  f.command->reasons = stop_reason::obstacle;
  test::latch(f.stop, f.command, 0, 1);
  PortAccess::set_held(f.velocity, 0, true, 0);
  f.job();
  CHECK(f.halts());
  f.command->reasons = 0;
  f.job();
  CHECK(f.base->commands == 0);
}

TEST_CASE("base: in safe_stop, and in a mode that has no name, zero is commanded each job whatever the inputs say") {
  for (const bool with_stop : {false, true}) {
    BaseFixture f(with_stop);
    if (with_stop) test::latch(f.stop, f.command, 0, 1);  // it says: drive
    f.job("no_stereo");
    CHECK(f.drives());
    for (const std::string_view mode : {kSafeStopMode, std::string_view()}) {
      f.job(mode);
      CHECK(f.halts());
      f.job(mode);
      CHECK(f.halts());
      PortAccess::set_held(f.velocity, 0, true, 0);  // nobody wants to drive: zero is commanded all the same
      f.job(mode);
      CHECK(f.halts());
      test::latch(f.velocity, f.wanted, 0, 1);
    }
    f.job("full");
    CHECK(f.drives());
  }
}
