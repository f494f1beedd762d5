// SPDX-License-Identifier: Apache-2.0
#include "nodes/navigation/path_planner.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <string>

#include "rt/memory/memory_use.hpp"
#include "rt/time/clock.hpp"

using namespace takt;
using namespace takt::navigation;

namespace {

/// Cells of 1 m written as text, the top row first: '#' occupied, '?' unknown, anything else free.
struct Field {
  std::vector<int16_t> cells;
  int width = 0, height = 0;

  explicit Field(const std::vector<std::string>& rows)
      : width(static_cast<int>(rows[0].size())), height(static_cast<int>(rows.size())) {
    for (auto row = rows.rbegin(); row != rows.rend(); ++row)
      for (const char c : *row) cells.push_back(c == '#' ? 1000 : c == '?' ? -1 : 0);
  }
  OccupancyView view(double cell_m = 1) const { return {{cells.data(), width, height}, cell_m, 0, 0}; }
};

}  // namespace

TEST_CASE("a way round a wall, its corners only, from place to place") {
  const Field f({".......",  //
                 "..###..",  //
                 "..#.#..",  //
                 "..#.#..",  //
                 "......."});
  PathPlanner planner(100, {0, 3});
  REQUIRE(planner.look(f.view()));
  std::vector<Place> path;
  REQUIRE(planner.plan({3.5, 1.5}, {3.5, 4.9}, 0, path) == PathOutcome::found);
  CHECK(planner.free(path));
  CHECK(path.front().y_m == 1.5);
  CHECK(path.back().x_m == 3.5);
  CHECK(path.back().y_m == 4.9);
  CHECK(path.size() >= 5);
  CHECK(path.size() <= 7);
  // One down, two to the side, four up, two back: the corners of the wall are not cut.
  CHECK(planner.cost() == 9 * PathPlanner::kStraight);
  CHECK(planner.cost_m() == 9);
}

TEST_CASE("what has no way says why") {
  const Field f({".#.", ".#.", ".#."});
  PathPlanner planner(9, {0, 3});
  REQUIRE(planner.look(f.view()));
  std::vector<Place> path;
  CHECK(planner.plan({0.5, 0.5}, {2.5, 0.5}, 0, path) == PathOutcome::no_way);
  CHECK(path.empty());
  CHECK(planner.plan({0.5, 0.5}, {1.5, 0.5}, 0, path) == PathOutcome::goal_blocked);
  CHECK(planner.plan({0.5, 0.5}, {3.5, 0.5}, 0, path) == PathOutcome::goal_outside);
  CHECK(planner.plan({-0.5, 0.5}, {0.5, 0.5}, 0, path) == PathOutcome::start_outside);
  CHECK(planner.plan({0.5, 0.5}, {1.5, 0.5}, 1, path) == PathOutcome::found);  // beside it is near enough
  CHECK_FALSE(PathPlanner(8, {0, 3}).look(f.view()));
}

TEST_CASE("unknown cells cost three, so that a known detour of less is taken") {
  const Field f({".....", ".???.", "....."});
  PathPlanner planner(15, {0, 3});
  REQUIRE(planner.look(f.view()));
  std::vector<Place> path;
  REQUIRE(planner.plan({0.5, 1.5}, {4.5, 1.5}, 0, path) == PathOutcome::found);
  CHECK(planner.cost() == 2 * PathPlanner::kStraight + 2 * PathPlanner::kDiagonal);
  for (const Place& place : path) CHECK((place.y_m != 1.5 || place.x_m == 0.5 || place.x_m == 4.5));
}

TEST_CASE("obstacles grow by the clearance; a robot that stands too near may only move away") {
  const Field f({"#....", ".....", ".....", ".....", "....."});
  PathPlanner planner(25, {1.5, 3});  // cells of 1 m: blocked unless all of it is 1.5 m from all of the corner's
  REQUIRE(planner.look(f.view()));
  CHECK(planner.blocked({2, 4}));
  CHECK(planner.blocked({2, 2}));
  CHECK_FALSE(planner.blocked({3, 4}));
  CHECK_FALSE(planner.blocked({3, 3}));
  PathPlanner whole(25, {2.0, 3});  // two whole cells between are enough
  REQUIRE(whole.look(f.view()));
  CHECK_FALSE(whole.blocked({3, 4}));
  std::vector<Place> path;
  CHECK(planner.plan({0.5, 3.5}, {4.5, 4.5}, 0, path) == PathOutcome::found);
  CHECK_FALSE(planner.free(path));
  CHECK(planner.plan({4.5, 4.5}, {0.5, 3.5}, 0, path) == PathOutcome::goal_blocked);
  const Field between({"#.#", "#.#", "#.#"});
  REQUIRE(planner.look(between.view()));
  CHECK(planner.plan({1.5, 0.5}, {1.5, 2.5}, 0.6, path) == PathOutcome::no_way);  // nowhere is farther from the walls
}

TEST_CASE("a door that closes makes a way be planned again") {
  Field f({"...#...",  //
           ".......",  //
           "...#...",  //
           "...#...",  //
           "......."});
  PathPlanner planner(35, {0, 3});
  REQUIRE(planner.look(f.view()));
  std::vector<Place> path;
  REQUIRE(planner.plan({1.5, 3.5}, {5.5, 3.5}, 0, path) == PathOutcome::found);
  CHECK(path.size() == 2);
  REQUIRE(planner.look(f.view()));
  CHECK(planner.free(path));
  f.cells[3 * 7 + 3] = 1000;
  REQUIRE(planner.look(f.view()));
  CHECK_FALSE(planner.free(path));
  REQUIRE(planner.plan({2.5, 3.5}, {5.5, 3.5}, 0, path) == PathOutcome::found);
  CHECK(planner.free(path));
  CHECK(planner.cost() > 6 * PathPlanner::kStraight);
}

TEST_CASE("planning takes no memory") {
  const Field f(std::vector<std::string>(40, std::string(40, '.')));
  PathPlanner planner(1600, {0, 3});
  std::vector<Place> path;
  path.reserve(1600);
  const uint64_t before = thread_memory_use().allocations;
  for (int i = 0; i < 40; ++i) {
    REQUIRE(planner.look(f.view()));
    REQUIRE(planner.plan({0.5, i + 0.5}, {39.5, 39.5 - i}, i % 3, path) == PathOutcome::found);
  }
  if (counting_allocations()) CHECK(thread_memory_use().allocations == before);
}

TEST_CASE("cost of a look and a way" * doctest::skip()) {  // a figure and no check; run with --no-skip
  // 40 x 40 m in cells of 0.1 m, walls every 5 m with a door each, in turn at both ends.
  constexpr int kCells = 400;
  std::vector<std::string> rows(kCells, std::string(kCells, '.'));
  for (size_t wall = 50; wall < kCells; wall += 50)
    for (size_t x = 0; x < kCells; ++x)
      if (const bool door = wall % 100 == 0 ? x < 20 : x >= kCells - 20; !door) rows[wall][x] = '#';
  const Field f(rows);
  PathPlanner planner(kCells * kCells, {0.58, 3});
  std::vector<Place> path;
  std::vector<double> look_ms, plan_ms;
  for (int i = 0; i < 50; ++i) {
    const int64_t begin = thread_cpu_ns();
    REQUIRE(planner.look(f.view(0.1)));
    const int64_t between = thread_cpu_ns();
    REQUIRE(planner.plan({1, 1}, {39, 39}, 0, path) == PathOutcome::found);
    look_ms.push_back(static_cast<double>(between - begin) * 1e-6);
    plan_ms.push_back(static_cast<double>(thread_cpu_ns() - between) * 1e-6);
  }
  std::sort(look_ms.begin(), look_ms.end());
  std::sort(plan_ms.begin(), plan_ms.end());
  MESSAGE("look " << look_ms[25] << " ms, way of " << planner.cost_m() << " m " << plan_ms[25] << " ms, "
                  << planner.expanded() << " cells expanded");
}
