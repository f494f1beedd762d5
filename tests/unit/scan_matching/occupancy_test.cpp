// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>

#include "nodes/scan_matching/drive.hpp"
#include "nodes/scan_matching/occupancy_map.hpp"
#include "rt/memory/memory_use.hpp"

using namespace takt::scan_matching;

namespace {

int at(const OccupancyMap& map, double x, double y) {
  return map.cells().at(static_cast<int>(std::floor((x - map.origin_x_m()) / 0.1)),
                        static_cast<int>(std::floor((y - map.origin_y_m()) / 0.1)));
}

}  // namespace

TEST_CASE("one beam: free up to its end, occupied there, unknown behind; more sweeps make it surer") {
  OccupancyMap map({});
  const std::vector<float> range{2.03f};
  const Sweep ahead{0, 0, range, {}};  // along y
  map.add({0.05, 0.05, 0}, ahead);
  CHECK(at(map, 0.05, 1.05) == 400);
  CHECK(at(map, 0.05, 2.05) == 700);
  CHECK(at(map, 0.05, 2.15) == kUnknown);
  CHECK(at(map, 0.15, 1.05) == kUnknown);
  for (int i = 0; i < 9; ++i) map.add({0.05, 0.05, 0}, ahead);
  CHECK(at(map, 0.05, 1.05) == kFree);
  CHECK(at(map, 0.05, 2.05) == kOccupied);
}

TEST_CASE("a beam without return tells nothing, one beyond the range that the way to there is free") {
  OccupancyParameters p;
  p.range_max_m = 3;
  OccupancyMap map(p);
  const std::vector<float> range{0.0f, 9.0f};
  map.add({0.05, 0.05, 0}, {0, std::numbers::pi / 2, range, {}});
  CHECK(at(map, 0.05, 1.05) == kUnknown);
  CHECK(at(map, -1.05, 0.05) == 400);
  CHECK(at(map, -2.85, 0.05) == 400);
  CHECK(at(map, -2.95, 0.05) == kUnknown);
  CHECK(at(map, -8.95, 0.05) == kUnknown);
}

TEST_CASE("the window follows the robot by whole cells; what leaves it is forgotten") {
  OccupancyParameters p;
  p.window_m = 8;
  OccupancyMap map(p);
  const std::vector<float> range{2.03f};
  map.add({0.05, 0.05, 0}, {0, 0, range, {}});
  map.centre(1.23, -1.5);
  CHECK(at(map, 0.05, 2.05) == 700);
  CHECK(at(map, 0.05, 1.05) == 400);
  CHECK(map.origin_x_m() == doctest::Approx(1.2 - 4));
  map.centre(5, 0);
  map.centre(0, 0);
  CHECK(at(map, 0.05, 2.05) == kUnknown);
  map.add({0.05, 0.05, 0}, {0, 0, range, {}});
  CHECK(at(map, 0.05, 2.05) == 700);
  map.centre(1000, 1000);
  CHECK(at(map, 1000.05, 1000.05) == kUnknown);
}

TEST_CASE("a map that was given goes on, at its place; one of another size is not taken") {
  OccupancyMap one({}), other({});
  const std::vector<float> range{2.03f};
  one.centre(3.25, -7.75);
  one.add({3.25, -7.75, 0}, {0, 0, range, {}});
  REQUIRE(other.resume(one.cells(), one.origin_x_m(), one.origin_y_m()));
  CHECK(at(other, 3.25, -7.75 + 2.03) == at(one, 3.25, -7.75 + 2.03));
  CHECK(at(other, 3.25, -7.75 + 2.03) == 700);
  CHECK(other.origin_y_m() == doctest::Approx(one.origin_y_m()));
  OccupancyParameters p;
  p.window_m = 4;
  OccupancyMap small(p);
  CHECK_FALSE(small.resume(one.cells(), 0, 0));
}

TEST_CASE("neither a sweep nor a move of the window allocates") {
  if (!takt::counting_allocations()) {
    MESSAGE("NOT RUN: this program does not count allocations (sanitizer)");
    return;
  }
  const Drive drive = make_drive(furnished_room(1), rounds(20), {}, 1);
  OccupancyMap map({});
  for (size_t i = 0; i < drive.scans.size(); ++i) {
    const uint64_t before = takt::thread_memory_use().allocations;
    map.centre(drive.scans[i].truth.x_m, drive.scans[i].truth.y_m);
    map.add(drive.scans[i].truth, drive.sweep(i));
    CHECK(takt::thread_memory_use().allocations == before);
  }
}
