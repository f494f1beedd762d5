// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "nodes/obstacle_stop/protected_field.hpp"
#include "nodes/obstacle_stop/stop_state.hpp"
#include "rt/msg/ace/stop_command.hpp"

using namespace takt;
using namespace takt::obstacle_stop;

namespace {
constexpr Footprint kRobot{0.28, 0.39, 0.39, 0.10};
constexpr Braking kBraking{1.0, 1.5, 0.35};
ProtectedField field_of(const Drive& drive) { return {kRobot, drive, stopping_time_s(drive, kBraking)}; }
}  // namespace

TEST_CASE("straight ahead the field ends where the robot stands: v^2 / (2 a) + v t beyond its front") {
  const double length = 1.4 * 1.4 / 2 + 1.4 * 0.35;
  const ProtectedField field = field_of({1.4, 0});
  CHECK(field.contains(0, 0.49 + length - 1e-6));
  CHECK_FALSE(field.contains(0, 0.49 + length + 1e-6));
  CHECK(field.contains(0.379, 1));
  CHECK_FALSE(field.contains(0.381, 1));
  CHECK(field.contains(0, -0.38));
  CHECK_FALSE(field.contains(0, -0.4));  // what it leaves behind
  CHECK_FALSE(field.contains(std::nan(""), 0));
}

TEST_CASE("a robot that stands needs no more than its own place; backwards the field lies behind") {
  CHECK(field_of({}).contains(0, 0.48));
  CHECK_FALSE(field_of({}).contains(0, 0.5));
  CHECK(field_of({}).contains(0.28 + 0.07, 0.39 + 0.07));
  CHECK_FALSE(field_of({}).contains(0.28 + 0.072, 0.39 + 0.072));  // round: 0.10 m from the robot's corner
  CHECK(field_of({-0.5, 0}).contains(0, -0.7));
  CHECK_FALSE(field_of({-0.5, 0}).contains(0, 0.5));
}

TEST_CASE("a robot may drive straight away from what stands in its margin, and not turn or drive on") {
  const double x = 0.1, y = 0.45;
  CHECK(field_of({}).contains(x, y));
  CHECK(field_of({0.1, 0}).contains(x, y));
  CHECK(field_of({0, 0.2}).contains(x, y));
  CHECK_FALSE(field_of({-0.1, 0}).contains(x, y));
  CHECK_FALSE(field_of({-0.1, 0.02}).contains(x, y));
  CHECK(field_of({-0.1, 0.4}).contains(x, y));     // about a centre within itself it swings
  CHECK(field_of({-0.1, 0}).contains(0.33, 0.2));  // beside it: no farther when it has gone on
  CHECK(field_of({-0.1, 0}).contains(x, 0.38));    // touched already
}

TEST_CASE("what is farther than the clearance never lies in the field of a robot that turns on the spot") {
  const double clearance = footprint(0.56, 0.78, 0.10).clearance_m();
  CHECK(clearance == doctest::Approx(0.5801).epsilon(1e-3));
  const ProtectedField spot = field_of({0, 2.0});
  bool reached = false;
  for (int degree = 0; degree < 360; ++degree) {
    const double c = std::cos(degree * std::numbers::pi / 180), s = std::sin(degree * std::numbers::pi / 180);
    CHECK_FALSE(spot.contains((clearance + 1e-6) * c, (clearance + 1e-6) * s));
    reached |= spot.contains((clearance - 1e-6) * c, (clearance - 1e-6) * s);
  }
  CHECK(reached);
}

TEST_CASE("a left turn sweeps to the left and leaves the right free; on the spot the corners swing out") {
  const ProtectedField left = field_of({0.8, 0.8}), right = field_of({0.8, -0.8});
  CHECK(left.contains(-0.5, 0.85));
  CHECK_FALSE(left.contains(0.5, 0.85));
  CHECK(right.contains(0.5, 0.85));
  CHECK_FALSE(right.contains(-0.5, 0.85));
  // The front right corner (0.28, 0.39) and its margin swing by 39 deg to straight ahead on a circle of 0.58 m, the
  // rear one to 16 deg behind the right.
  const ProtectedField spot = field_of({0, 1.0});
  CHECK(spot.contains(0, 0.57));
  CHECK_FALSE(spot.contains(-0.2, 0.54));
  CHECK(spot.contains(0.53, -0.2));
  CHECK_FALSE(spot.contains(0.57, 0.05));
  CHECK_FALSE(spot.contains(0, 0.59));
}

TEST_CASE("a lone beam is dust, two neighbours are an obstacle; no return and NaN are none") {
  const ProtectedField field = field_of({1, 0});
  Sweep sweep{-std::numbers::pi / 2, std::numbers::pi / 180, {0, 0.3, 0.25, 1, 0, 0, 0}, {}};
  std::vector<float> ranges(181, 0.0f);
  sweep.range_m = ranges;
  CHECK_FALSE(read_field(sweep, field, 2).blocked);
  ranges[90] = 0.7f;
  CHECK_FALSE(read_field(sweep, field, 2).blocked);
  CHECK(read_field(sweep, field, 1).blocked);
  ranges[92] = 0.7f;  // another one, but not next to it
  CHECK_FALSE(read_field(sweep, field, 2).blocked);
  ranges[91] = std::nanf("");
  CHECK_FALSE(read_field(sweep, field, 2).blocked);
  ranges[91] = 0.6f;
  const FieldReading reading = read_field(sweep, field, 2);
  CHECK(reading.blocked);
  CHECK(reading.nearest_m == doctest::Approx(0.6));
  CHECK(read_field(sweep, field, 3).blocked);
  CHECK_FALSE(read_field(sweep, field, 4).blocked);
}

TEST_CASE("blinded beams hide what is as wide as the gap between those that see") {
  const ProtectedField field = field_of({1, 0});  // ends at 1.34 m
  Sweep sweep{-std::numbers::pi / 2, std::numbers::pi / 360, {0, 0.3, 0.25, 1, 0, 0, 0}, {}};
  std::vector<float> ranges(361, 0.0f);
  sweep.range_m = ranges;
  const auto blind = [&](size_t first, size_t count) {
    std::fill(ranges.begin(), ranges.end(), 0.0f);
    std::fill_n(ranges.begin() + static_cast<ptrdiff_t>(first), count, std::nanf(""));
  };
  CHECK_FALSE(could_hide(sweep, field, 0.08));
  // Ahead the field ends 1.04 m from the scanner, where beams are 9 mm apart: eight of them leave a gap of 82 mm.
  blind(177, 7);
  CHECK_FALSE(could_hide(sweep, field, 0.08));
  blind(177, 8);
  CHECK(could_hide(sweep, field, 0.08));
  CHECK_FALSE(could_hide(sweep, field, 0.09));
  blind(0, 20);  // to the right the field is near: 0.38 m, 3 mm
  CHECK_FALSE(could_hide(sweep, field, 0.08));
  CHECK(could_hide(sweep, field, 0.04));
  blind(0, 361);
  CHECK(could_hide(sweep, field, 0.3));
  for (size_t i = 0; i < ranges.size(); i += 4) ranges[i] = 5;  // every fourth beam sees
  CHECK_FALSE(could_hide(sweep, field, 0.08));
  CHECK_FALSE(could_hide({0, 0.01, {}, {}}, field, 0.08));
}

TEST_CASE("beam 0 points to the right; the scanner's mount moves and turns its beams") {
  std::vector<float> ranges(181, 0.0f);
  ranges[0] = ranges[1] = 0.5f;
  Sweep sweep{-std::numbers::pi / 2, std::numbers::pi / 180, {}, ranges};
  const ProtectedField right({0.6, 0.1, 0.1}, {}, 0), left({0.1, 0.1, 0.1}, {}, 0);
  CHECK(read_field(sweep, right, 2).blocked);
  CHECK_FALSE(read_field(sweep, left, 2).blocked);
  sweep.sensor_in_robot.x = -0.5;  // the same beams now end at the robot's centre
  CHECK(read_field(sweep, left, 2).blocked);
  const double half = std::numbers::pi / 4;  // turned left by 90 degrees beam 0 points ahead
  sweep.sensor_in_robot = {0, -0.5, 0, std::cos(half), 0, 0, std::sin(half)};
  CHECK(read_field(sweep, left, 2).blocked);
}

TEST_CASE("a stop of the field ends only after scans have shown it free for long enough") {
  FieldState state(stop_reason::scan_lost, 500);
  CHECK(state.update(0, 1000) == stop_reason::scan_lost);  // nothing has been seen before
  CHECK(state.update(0, 1499) == stop_reason::scan_lost);
  CHECK(state.update(0, 1500) == 0);
  CHECK(state.update(stop_reason::obstacle, 1600) == stop_reason::obstacle);
  CHECK(state.update(0, 1700) == stop_reason::obstacle);
  CHECK(state.update(stop_reason::scan_lost, 1700) == (stop_reason::obstacle | stop_reason::scan_lost));
  CHECK(state.update(0, 2100) != 0);
  CHECK(state.update(0, 2100) != 0);  // the same scan again proves nothing
  CHECK(state.update(0, 2599) != 0);
  CHECK(state.update(0, 2600) == 0);
}

TEST_CASE("the line stops at level 0, and for a while after a pulse") {
  LineState line(2, 100);
  CHECK_FALSE(line.stops(0));
  line.see(0b100, 0b011, 10);  // other lines do not matter
  CHECK_FALSE(line.stops(10));
  line.see(0b011, 0b100, 20);
  CHECK(line.stops(20));
  CHECK(line.stops(5000));  // as long as it is low
  line.see(0b100, 0b100, 6000);
  CHECK(line.stops(6099));
  CHECK_FALSE(line.stops(6100));
  line.see(0b100, 0b100, 7000);  // down and up again between two reads
  CHECK(line.stops(7000));
  line.see(0b100, 0, 7050);
  CHECK(line.stops(7099));
  CHECK_FALSE(line.stops(7100));
}
