// SPDX-License-Identifier: Apache-2.0
#include "nodes/obstacle_stop/sweep_memory.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "tests/nanoseconds.hpp"

using namespace takt;
using namespace takt::obstacle_stop;
using test::kMs;

namespace {

constexpr size_t kBeams = 181, kAhead = 90;

/// A scanner of one degree at the robot's centre.
struct View {
  std::vector<float> range_m = std::vector<float>(kBeams, 5.0f);
  Sweep sweep() const { return {-std::numbers::pi / 2, std::numbers::pi / 180, {0, 0, 0, 1, 0, 0, 0}, range_m}; }
  View& thing(size_t first, size_t last, float range) {
    std::fill(range_m.begin() + static_cast<ptrdiff_t>(first), range_m.begin() + static_cast<ptrdiff_t>(last) + 1,
              range);
    return *this;
  }
};

size_t counted(SweepMemory& memory, const View& view, int64_t stamp_ns, const PlanarPose& robot = {}) {
  const auto moved_in = memory.moved_in(view.sweep(), robot, stamp_ns, 3);
  return static_cast<size_t>(std::count_if(moved_in.begin(), moved_in.end(), [](float r) { return r > 0; }));
}

}  // namespace

TEST_CASE("what stands where beams passed through a second ago has moved in; the wall behind it has not") {
  SweepMemory memory(kBeams, 1000 * kMs);
  View before, after;
  before.thing(20, 60, 2.0f);
  after.thing(20, 60, 2.0f).thing(85, 95, 1.5f);
  CHECK(counted(memory, after, 0) == 0);  // nothing has been seen before
  memory.add(before.sweep(), {}, 0);
  CHECK(counted(memory, before, 100 * kMs) == 0);
  const auto moved_in = memory.moved_in(after.sweep(), {}, 900 * kMs, 3);
  for (size_t beam = 0; beam < kBeams; ++beam)
    CHECK(moved_in[beam] == (beam >= 85 && beam <= 95 ? after.range_m[beam] : 0));
  CHECK(counted(memory, after, 1001 * kMs) == 0);
  before.thing(0, kBeams - 1, 0);  // no return at all: farther than the scanner sees
  memory.add(before.sweep(), {}, 1000 * kMs);
  CHECK(counted(memory, after, 1001 * kMs) > 0);
}

TEST_CASE(
    "no beam can tell what was behind something, where the scanner was blinded, beside its view, or between beams") {
  View before, after;
  after.thing(85, 95, 1.5f);
  before.thing(80, 100, 1.0f);
  SweepMemory memory(kBeams, 1000 * kMs);
  memory.add(before.sweep(), {}, 0);
  CHECK(counted(memory, after, 100 * kMs) == 0);
  before.thing(80, 100, std::nanf(""));
  memory = SweepMemory(kBeams, 1000 * kMs);
  memory.add(before.sweep(), {}, 0);
  CHECK(counted(memory, after, 100 * kMs) == 0);
  View edge;
  edge.thing(0, 0, 1.5f);
  CHECK(counted(memory, edge, 100 * kMs) == 0);
  View wide_gaps;
  wide_gaps.thing(85, 95, 2.95f);  // beams are 5.1 cm apart there
  memory = SweepMemory(kBeams, 1000 * kMs);
  memory.add(View{}.sweep(), {}, 0);
  CHECK(counted(memory, wide_gaps, 100 * kMs) == 0);
  wide_gaps.thing(85, 95, 2.8f);
  CHECK(counted(memory, wide_gaps, 100 * kMs) == 11);
  CHECK(memory.moved_in(wide_gaps.sweep(), {}, 100 * kMs, 2.5)[90] == 0);  // beyond the reach asked for
}

TEST_CASE("an edge that lies two degrees aside of where it was, or a wall ten centimetres nearer, is noise") {
  SweepMemory memory(kBeams, 1000 * kMs);
  View before, after;
  before.thing(85, 95, 1.5f);
  after.thing(83, 97, 1.4f);
  memory.add(before.sweep(), {}, 0);
  CHECK(counted(memory, after, 100 * kMs) == 0);
  after.thing(80, 100, 1.5f);
  CHECK(counted(memory, after, 100 * kMs) == 6);  // beams 80 .. 82 and 98 .. 100
}

TEST_CASE("the robot's own motion moves nothing in: poses come from odometry") {
  // A wall across at y = 2.2 m, seen from 0 and, turned by 20 degrees, from 0.5 m on.
  const auto wall = [](const PlanarPose& robot) {
    View view;
    for (size_t beam = 0; beam < kBeams; ++beam) {
      const double angle = view.sweep().angle_rad(beam) + robot.theta_rad;
      const double range = (2.2 - robot.y_m) / std::cos(angle);
      view.range_m[beam] = range > 0 && range < 8 ? static_cast<float>(range) : 0;
    }
    return view;
  };
  const PlanarPose start{}, later{0.1, 0.5, 20 * std::numbers::pi / 180};
  SweepMemory memory(kBeams, 1000 * kMs);
  memory.add(wall(start).sweep(), start, 0);
  CHECK(counted(memory, wall(later), 500 * kMs, later) == 0);
  CHECK(counted(memory, wall(later), 500 * kMs, start) > 10);  // had odometry said that it stood
  const View in_the_way = wall(later).thing(kAhead, kAhead + 8, 1.0f);
  CHECK(counted(memory, in_the_way, 500 * kMs, later) == 9);
}

TEST_CASE("eight sweeps share the span: one that comes too soon after the last kept is not kept itself") {
  SweepMemory memory(kBeams, 800 * kMs);
  View open, after;
  View closed;
  closed.thing(80, 100, 1.5f);
  after.thing(85, 95, 1.5f);
  memory.add(closed.sweep(), {}, 0);
  memory.add(open.sweep(), {}, 99 * kMs);
  CHECK(counted(memory, after, 150 * kMs) == 0);
  memory.add(open.sweep(), {}, 100 * kMs);
  CHECK(counted(memory, after, 150 * kMs) == 11);
  for (int64_t i = 2; i < 10; ++i) memory.add(closed.sweep(), {}, i * 100 * kMs);
  CHECK(counted(memory, after, 900 * kMs) == 0);  // the ninth took the place of the open one
}

TEST_CASE("a memory without beams, and one for fewer than a sweep has, remember nothing") {
  SweepMemory none, small(100, 1000 * kMs);
  View after;
  after.thing(85, 95, 1.5f);
  for (SweepMemory* memory : {&none, &small}) {
    memory->add(View{}.sweep(), {}, 0);
    CHECK(counted(*memory, after, 100 * kMs) == 0);
  }
}
