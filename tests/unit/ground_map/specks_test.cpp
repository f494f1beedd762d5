// SPDX-License-Identifier: Apache-2.0
#include "nodes/ground_map/specks.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "rt/msg/laser_scan.hpp"
#include "rt/testing.hpp"

using namespace takt;
using namespace takt::ground_map;

namespace {

/// Rows of '#' occupied, '+' undecided, '.' free, '?' unknown.
std::vector<int16_t> cells_of(const std::string& rows) {
  std::vector<int16_t> cells;
  for (const char c : rows)
    cells.push_back(c == '#' ? int16_t{1000} : c == '+' ? int16_t{500} : c == '?' ? kUnknown : kFree);
  return cells;
}

std::string cleared(const std::string& rows, int side, int most, int blind_column = -1) {
  std::vector<int16_t> cells = cells_of(rows);
  Specks specks(side, most);
  specks.clear(ImageView<int16_t>{cells.data(), side, side}, [&](int column, int) { return column != blind_column; });
  std::string text;
  for (const int16_t cell : cells) text += cell == 1000 ? '#' : cell == 500 ? '+' : cell == kUnknown ? '?' : '.';
  return text;
}

/// A scanner of one degree, 0.3 m before the robot's centre, to which everything is 6 m away.
struct Scan : test::Box<LaserScan> {
  Scan() : Box({0, 0, 1, 181}) {
    LaserScan& scan = **this;
    scan.first_angle_rad = -std::numbers::pi / 2;
    scan.step_rad = std::numbers::pi / 180;
    scan.sensor_in_robot.y = 0.3;
    scan.range_m.resize(181);
    for (float& range : scan.range_m.items()) range = 6;
  }
};

}  // namespace

TEST_CASE("small islands amid free floor go, borders and larger things stay") {
  const std::string floor =
      "########"
      "........"
      ".#....#."
      "......#."
      "..#..#.."
      ".#......"
      "....+..."
      "........";
  CHECK(cleared(floor, 8, 3) ==
        "########"
        "........"
        "........"
        "........"
        "........"
        "........"
        "....+..."
        "........");
  // The islands have 1, 3 (over a corner) and 2 cells.
  const std::string two = cleared(floor, 8, 2);
  CHECK(std::count(two.begin(), two.end(), '#') == 8 + 3);
  CHECK(cleared(floor, 8, 0) == floor);
  CHECK(std::count(floor.begin(), floor.end(), '#') - 6 == 8);
}

TEST_CASE("an island beside what is unknown, at the window's edge, or behind which the scanner does not see stays") {
  const std::string unknown =
      "....."
      "..?.."
      "..#.."
      "....."
      ".....";
  CHECK(cleared(unknown, 5, 3) == unknown);
  const std::string edge =
      "....."
      "....."
      "#...."
      "....."
      ".....";
  CHECK(cleared(edge, 5, 3) == edge);
  const std::string two =
      "....."
      ".##.."
      "....."
      "....."
      ".....";
  CHECK(cleared(two, 5, 3, 2) == two);
  CHECK(cleared(two, 5, 3, 3) ==
        "....."
        "....."
        "....."
        "....."
        ".....");
}

TEST_CASE("a scanner sees past a cell if no beam ends before or in it") {
  Scan scan;
  const FloorPoint cell{0.5, 2.3};
  CHECK(sees_past(*scan, cell, 0.3));
  for (float& range : scan->range_m.items()) range = 0;  // no return
  CHECK(sees_past(*scan, cell, 0.3));
  // 14 degrees to the right, 2.06 m from the scanner, half a cell's diagonal 5.9 degrees wide.
  scan->range_m[76] = 2.2f;
  CHECK_FALSE(sees_past(*scan, cell, 0.3));
  scan->range_m[76] = 2.3f;
  CHECK(sees_past(*scan, cell, 0.3));
  scan->range_m[76] = std::nanf("");
  CHECK_FALSE(sees_past(*scan, cell, 0.3));
  scan->range_m[76] = 0;
  scan->range_m[60] = 1;  // beside it
  CHECK(sees_past(*scan, cell, 0.3));
  CHECK_FALSE(sees_past(*scan, {0.5, -2}, 0.3));    // behind the robot
  CHECK_FALSE(sees_past(*scan, {2, 0.35}, 0.3));    // half of it outside the view
  CHECK_FALSE(sees_past(*scan, {0.05, 0.4}, 0.3));  // around the scanner itself
}
