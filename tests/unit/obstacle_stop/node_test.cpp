// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <numbers>
#include <vector>

#include "rt/memory/memory_use.hpp"
#include "rt/msg/ace/digital_state.hpp"
#include "rt/msg/ace/stop_command.hpp"
#include "rt/msg/laser_scan.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/msg/velocity_command.hpp"
#include "rt/sched/port_access.hpp"
#include "rt/testing.hpp"
#include "tests/nanoseconds.hpp"

namespace takt {
void register_obstacle_stop(NodeTypes& types);
}

using namespace takt;
using test::kMs;

namespace {

int64_t cpu_ns() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}

struct Fixture {
  VirtualClock clock;
  std::unique_ptr<Node> node;
  std::unique_ptr<test::BoxWriter<StopCommand>> out;
  test::Box<LaserScan> scan{{0, 0, 1, 181}};
  test::Box<DigitalState> lines;
  test::Box<Odometry> odometry;
  test::Box<VelocityCommand> velocity;
  uint64_t sequence = 0;
  int64_t now_ns = 1'000 * kMs;

  /// Things may come and go as they like, unless there is a margin for those that move.
  explicit Fixture(bool with_lines = false, bool with_odometry = true, bool with_velocity = false,
                   double moving_margin_m = 0) {
    NodeTypes types;
    register_obstacle_stop(types);
    REQUIRE(types.find("obstacle_stop")->layer == Layer::perception);
    node = types.find("obstacle_stop")->make();
    test::set(*node, "moving_margin", moving_margin_m);
    PortAccess::connect(test::input(*node, "scan"), {0, 0, 1, 181});
    if (with_lines) PortAccess::connect(test::input(*node, "lines"), {});
    if (with_odometry) PortAccess::connect(test::input(*node, "odometry"), {});
    if (with_velocity) PortAccess::connect(test::input(*node, "velocity"), {});
    Setup setup{clock, ".", ".", 0, std::nullopt, 0};
    node->setup(setup);
    out = std::make_unique<test::BoxWriter<StopCommand>>(*node->outputs()[0]);
    scan->first_angle_rad = -std::numbers::pi / 2;
    scan->step_rad = std::numbers::pi / 180;
    scan->sensor_in_robot.y = 0.3;
    scan->range_m.resize(181);
    free();
    lines->levels = 1;
    odometry->speed_m_s = 1;
  }
  void free() {
    for (float& r : scan->range_m.items()) r = 0;
  }
  /// A wall that far before the scanner.
  void wall(float range) {
    for (size_t i = 80; i <= 100; ++i) scan->range_m[i] = range;
  }
  template <class T>
  void give(const char* port, test::Box<T>& box, int64_t age_ns = 0) {
    test::latch(test::input(*node, port), box, now_ns - age_ns, ++sequence);
  }
  StopCommand job(std::string_view mode = "full") {
    out->clear();
    Job job(clock, 0, now_ns, now_ns + 66 * kMs, 0, mode);
    node->run(job);
    REQUIRE(out->sent());
    CHECK_FALSE(job.without_result());
    return out->message();
  }
  /// Jobs at 10 Hz with fresh data, until the node lets the robot drive.
  StopCommand drive_on() {
    StopCommand command;
    for (int i = 0; i < 8; ++i, now_ns += 100 * kMs) {
      give("scan", scan, 10 * kMs);
      give("odometry", odometry);
      if (test::input(*node, "lines").connected()) give("lines", lines);
      command = job();
    }
    now_ns -= 100 * kMs;
    return command;
  }
};

}  // namespace

TEST_CASE("obstacle_stop: in the mode safe_stop the robot stands, however free its way; afterwards it drives on") {
  Fixture f;
  CHECK(f.drive_on().reasons == 0);
  CHECK(f.job(kSafeStopMode).reasons == stop_reason::safe_stop);
  CHECK(f.job().reasons == 0);
}

TEST_CASE(
    "obstacle_stop: silent until a scan has been free for a while, then drive on; the command has the scan's stamp") {
  Fixture f;
  CHECK(f.job().reasons == stop_reason::scan_lost);
  CHECK(f.out->stamp_ns() == f.now_ns);
  CHECK(f.drive_on().reasons == 0);
  CHECK(f.out->stamp_ns() == f.now_ns - 10 * kMs);
  CHECK(f.out->message().scan_age_s == doctest::Approx(0.01));
  CHECK(f.out->message().nearest_m == 0);
}

TEST_CASE("obstacle_stop: where the scanner is blinded in the robot's way, that is no free way") {
  Fixture f;
  CHECK(f.drive_on().reasons == 0);
  f.wall(std::nanf(""));
  f.give("scan", f.scan);
  CHECK(f.job().reasons == stop_reason::scan_lost);
  CHECK(f.out->message().nearest_m == 0);
  f.free();
  f.scan->range_m[90] = f.scan->range_m[120] = std::nanf("");  // too narrow for a leg
  CHECK(f.drive_on().reasons == 0);
}

TEST_CASE("obstacle_stop: the field grows with the speed, and without odometry is that of speed_max") {
  // At 1 m/s the field ends 1.34 m before the robot's centre, at 1.4 m/s 1.96 m; the scanner sits at 0.3 m.
  Fixture f;
  f.drive_on();
  f.wall(1.2f);
  f.give("scan", f.scan);
  CHECK(f.job().reasons == 0);
  f.odometry->speed_m_s = 1.4;
  f.give("odometry", f.odometry);
  const StopCommand command = f.job();
  CHECK(command.reasons == stop_reason::obstacle);
  CHECK(command.nearest_m == doctest::Approx(1.2));
  Fixture blind(false, false);
  blind.wall(1.2f);
  blind.give("scan", blind.scan);
  CHECK((blind.job().reasons & stop_reason::obstacle) != 0);
  Fixture gone;
  gone.odometry->speed_m_s = 0.1;
  gone.drive_on();
  gone.wall(1.2f);
  gone.give("scan", gone.scan);
  CHECK(gone.job().reasons == 0);
  PortAccess::set_held(test::input(*gone.node, "odometry"), 1, true, 0);  // stale
  CHECK(gone.job().reasons == stop_reason::obstacle);
}

TEST_CASE("obstacle_stop: a robot that stands is judged by what is wanted of it: away from a wall it may, at it not") {
  Fixture f(false, true, true);
  f.odometry->speed_m_s = 0;
  f.drive_on();
  const auto wanted = [&](double speed, double turn) {
    f.velocity->speed_m_s = speed;
    f.velocity->turn_rad_s = turn;
    f.give("velocity", f.velocity);
    return f.drive_on().reasons;
  };
  f.wall(0.15f);  // 0.06 m before the robot
  CHECK(wanted(0, 0) == stop_reason::obstacle);
  CHECK(wanted(0.1, 0) == stop_reason::obstacle);
  CHECK(wanted(0, 0.3) == stop_reason::obstacle);
  CHECK(wanted(-0.1, 0) == 0);
  f.odometry->speed_m_s = 0.1;  // whatever is wanted of one that moves on
  CHECK(f.drive_on().reasons == stop_reason::obstacle);
  f.odometry->speed_m_s = -0.1;
  CHECK(f.drive_on().reasons == 0);
  f.odometry->speed_m_s = 0;
  f.wall(0.6f);  // it would stand 0.24 m behind the wall's margin, from 0.8 m/s
  CHECK(wanted(0.1, 0) == 0);
  CHECK(wanted(0.8, 0) == stop_reason::obstacle);
  PortAccess::set_held(test::input(*f.node, "velocity"), 1, true, 0);  // stale: nobody wants anything
  CHECK(f.drive_on().reasons == 0);
}

TEST_CASE("obstacle_stop: one that brakes is held while what it wants to go on with is not free") {
  Fixture f(false, true, true);
  f.velocity->speed_m_s = 0.8;
  f.give("velocity", f.velocity);
  f.odometry->speed_m_s = 0.2;
  f.drive_on();
  f.wall(0.6f);  // free of the field of 0.2 m/s, not of that of 0.8 m/s
  CHECK(f.drive_on().reasons == stop_reason::obstacle);
  f.velocity->speed_m_s = 0.1;
  f.give("velocity", f.velocity);
  CHECK(f.drive_on().reasons == 0);
  f.velocity->speed_m_s = -0.8;  // it has to stand before it drives back
  f.give("velocity", f.velocity);
  CHECK(f.drive_on().reasons == 0);
  f.odometry->speed_m_s = 0.8;
  CHECK(f.drive_on().reasons == stop_reason::obstacle);
}

TEST_CASE("obstacle_stop: one that is about to turn still goes on straight") {
  Fixture f(false, true, true);
  f.odometry->speed_m_s = 0.8;
  f.velocity->speed_m_s = 0.8;
  f.velocity->turn_rad_s = 1.2;
  f.give("velocity", f.velocity);
  f.drive_on();
  f.wall(0.65f);
  CHECK(f.drive_on().reasons == stop_reason::obstacle);
}

TEST_CASE(
    "obstacle_stop: what moves in stops the robot from farther off than what was there, until it has stood a while") {
  // At 0.2 m/s the field ends 0.58 m before the robot's centre, that of what moves 1.18 m.
  Fixture f(false, true, false, 0.7);
  f.odometry->speed_m_s = 0.2;
  f.wall(0.6f);
  f.drive_on(), f.drive_on();
  CHECK(f.drive_on().reasons == 0);  // 2.4 s later: it was always there
  f.free();
  CHECK(f.drive_on().reasons == 0);
  f.wall(0.6f);
  f.give("scan", f.scan);
  CHECK(f.job().reasons == stop_reason::obstacle);
  CHECK(f.out->message().nearest_m == doctest::Approx(0.6));
  CHECK(f.drive_on().reasons == stop_reason::obstacle);
  f.drive_on();
  CHECK(f.drive_on().reasons == 0);  // after 1.5 s, and the release
  f.wall(0.9f);                      // farther off than that
  f.give("scan", f.scan);
  CHECK(f.job().reasons == 0);
}

TEST_CASE("obstacle_stop: without odometry nobody can tell what has moved in; what the robot drives up to has not") {
  Fixture lost(false, true, false, 0.7);
  test::set(*lost.node, "speed_max", 0.2);
  lost.odometry->x_m = std::nan("");
  lost.odometry->speed_m_s = 0.2;
  lost.drive_on();
  lost.wall(0.6f);
  lost.give("scan", lost.scan);
  CHECK(lost.job().reasons == 0);
  Fixture nearer(false, true, false, 0.7);
  nearer.odometry->speed_m_s = 0.2;
  nearer.odometry->theta_rad = std::numbers::pi / 2;  // it drives along y
  nearer.wall(1.1f);
  for (int i = 0; i < 5; ++i) {
    nearer.drive_on();
    CHECK(nearer.job().reasons == 0);
    nearer.odometry->y_m += 0.08;
    nearer.wall(1.1f - 0.08f * static_cast<float>(i + 1));
  }
}

TEST_CASE("obstacle_stop: released only after release_after of free scans") {
  Fixture f;
  f.drive_on();
  f.wall(0.5f);
  f.give("scan", f.scan);
  CHECK(f.job().reasons == stop_reason::obstacle);
  f.free();
  for (int i = 1; i <= 5; ++i) {
    f.now_ns += 100 * kMs;
    f.give("scan", f.scan);
    CHECK(f.job().reasons == stop_reason::obstacle);
  }
  f.now_ns += 100 * kMs;
  f.give("scan", f.scan);
  CHECK(f.job().reasons == 0);
}

TEST_CASE("obstacle_stop: an old scan, a stale one and one without geometry are lost scans") {
  Fixture f;
  f.drive_on();
  f.now_ns += 150 * kMs;
  CHECK(f.job().reasons == 0);
  f.now_ns += 50 * kMs;
  CHECK(f.job().reasons == stop_reason::scan_lost);
  CHECK(f.out->message().scan_age_s == doctest::Approx(0.21));
  for (const int fault : {0, 1, 2}) {
    CAPTURE(fault);
    Fixture g;
    g.drive_on();
    if (fault == 0) g.scan->range_m.resize(0);
    if (fault == 1) g.scan->sensor_in_robot.qw = std::nan("");
    g.give("scan", g.scan);
    if (fault == 2) PortAccess::set_held(test::input(*g.node, "scan"), 1, true, 0);
    CHECK(g.job().reasons == stop_reason::scan_lost);
  }
}

TEST_CASE("obstacle_stop: the emergency-stop line by level, by pulse, and when it falls silent") {
  Fixture f(true);
  CHECK(f.drive_on().reasons == 0);
  f.lines->levels = 0;
  f.give("lines", f.lines);
  CHECK(f.job().reasons == stop_reason::line);
  f.lines->levels = f.lines->changed = 1;
  CHECK(f.drive_on().reasons == stop_reason::line);  // 0.7 s later `changed` keeps it for another second
  f.lines->changed = 0;
  CHECK(f.drive_on().reasons == stop_reason::line);
  CHECK(f.drive_on().reasons == 0);
  f.lines->changed = 1;
  f.give("lines", f.lines);
  CHECK(f.job().reasons == stop_reason::line);
  f.lines->changed = 0;
  f.drive_on(), f.drive_on();
  CHECK(f.job().reasons == 0);

  // Of several readings in one period each counts: the pulse was in an earlier one.
  test::Box<DigitalState> pulse;
  auto& port = test::input(*f.node, "lines");
  test::latch(port, pulse, f.now_ns, ++f.sequence, 0);
  test::latch(port, f.lines, f.now_ns, ++f.sequence, 1);
  CHECK(f.job().reasons == stop_reason::line);

  Fixture silent(true);
  silent.drive_on();
  silent.now_ns += 201 * kMs;
  silent.give("scan", silent.scan);
  CHECK(silent.job().reasons == stop_reason::line_lost);
  PortAccess::set_held(test::input(*silent.node, "lines"), 0, true, 0);
  CHECK(silent.job().reasons == stop_reason::line_lost);
}

TEST_CASE("obstacle_stop allocates nothing in a job") {
  if (!counting_allocations()) {
    MESSAGE("NOT RUN: this program does not count allocations (sanitizer)");
    return;
  }
  Fixture f(true, true, false, 0.7);
  f.wall(1.0f);
  f.odometry->turn_rad_s = 0.3;
  f.drive_on();
  f.out->clear();
  Job job(f.clock, 0, f.now_ns, f.now_ns + 66 * kMs, 0, "full");
  const uint64_t before = thread_memory_use().allocations;
  f.node->run(job);
  CHECK(thread_memory_use().allocations == before);
}

TEST_CASE("cost of a job" * doctest::skip()) {  // a figure and no check; run with --no-skip
  for (const bool near : {false, true}) {
    Fixture f(true, true, false, 0.7);
    f.odometry->turn_rad_s = near ? 0.4 : 0;
    for (float& r : f.scan->range_m.items()) r = near ? 0.9f : 8.0f;
    f.drive_on();
    std::vector<double> us;
    for (int i = 0; i < 1000; ++i) {
      const int64_t start = cpu_ns();
      f.job();
      us.push_back(static_cast<double>(cpu_ns() - start) * 1e-3);
    }
    std::sort(us.begin(), us.end());
    MESSAGE((near ? "turning, all near: " : "straight, all far: ")
            << us[500] << " us median, " << us[990] << " us p99, with the harness's own");
  }
}
