// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <map>
#include <queue>
#include <random>

#include "nodes/navigation/pilot.hpp"
#include "nodes/obstacle_stop/protected_field.hpp"
#include "tests/property_scale.hpp"

using namespace takt::navigation;

namespace {

struct RandomField {
  std::vector<int16_t> cells;
  OccupancyView view;

  RandomField(std::mt19937& random, int width, int height, double occupied, double unknown, double cell_m = 0.2) {
    std::uniform_real_distribution<double> share(0, 1);
    for (int i = 0; i < width * height; ++i) {
      const double s = share(random);
      cells.push_back(s < occupied ? int16_t{1000} : s < occupied + unknown ? kUnknownCell : int16_t{300});
    }
    view = {{cells.data(), width, height}, cell_m, -3, 7};
  }
};

/// By looking at every cell for every cell: how near two places in them can be.
bool blocked(const OccupancyView& view, const Cell& cell, double clearance_m) {
  for (int row = 0; row < view.cells.height; ++row)
    for (int column = 0; column < view.cells.width; ++column) {
      if (view.cells.at(column, row) <= kHalfOccupied) continue;
      const double right = std::max(0, std::abs(column - cell.column) - 1),
                   up = std::max(0, std::abs(row - cell.row) - 1);
      if (Cell{column, row} == cell || std::hypot(right, up) * view.cell_m < clearance_m - 1e-9) return true;
    }
  return false;
}

using Key = std::pair<int, int>;

/// Least cost from a free cell to another (Dijkstra); -1: there is no way.
int64_t least_cost(const std::map<Key, bool>& free, const OccupancyView& view, const Key& from, const Key& to) {
  std::map<Key, int64_t> cost{{from, 0}};
  std::priority_queue<std::pair<int64_t, Key>, std::vector<std::pair<int64_t, Key>>, std::greater<>> open;
  open.push({0, from});
  while (!open.empty()) {
    const auto [so_far, at] = open.top();
    open.pop();
    if (at == to) return so_far;
    if (cost[at] < so_far) continue;
    for (int dx = -1; dx <= 1; ++dx)
      for (int dy = -1; dy <= 1; ++dy) {
        const Key next{at.first + dx, at.second + dy};
        const auto open_cell = [&](const Key& c) { return free.contains(c) && free.at(c); };
        if (next == at || !open_cell(next)) continue;
        if (dx != 0 && dy != 0 && (!open_cell({at.first + dx, at.second}) || !open_cell({at.first, at.second + dy})))
          continue;
        const int64_t length = dx != 0 && dy != 0 ? 1414 : 1000;
        const int64_t sum = so_far + (view.cells.at(next.first, next.second) == kUnknownCell ? 3 : 1) * length;
        const auto [known, added] = cost.try_emplace(next, sum);
        if (!added && known->second <= sum) continue;
        known->second = sum;
        open.push({sum, next});
      }
  }
  return -1;
}

}  // namespace

TEST_CASE(
    "ways to where two places are in reach, and to the nearest cell beside an unknown one, cost what Dijkstra's do") {
  std::mt19937 random(takt::test::seed(5));
  const auto below = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
  PathPlanner planner(400, {0.1, 3});
  size_t near = 0, unknown = 0, none = 0;
  std::vector<Place> path;
  for (int round = 0; round < takt::test::rounds(150); ++round) {
    CAPTURE(round);
    const RandomField field(random, 5 + below(14), 5 + below(14), 0.1, 0.15);
    REQUIRE(planner.look(field.view));
    std::map<Key, bool> free;
    std::vector<Cell> cells;
    for (int row = 0; row < field.view.cells.height; ++row)
      for (int column = 0; column < field.view.cells.width; ++column) {
        free[{column, row}] = !planner.blocked({column, row});
        if (free[{column, row}]) cells.push_back({column, row});
      }
    if (cells.empty()) continue;
    const auto middle = [&](const Cell& c) { return Place{field.view.middle_x_m(c), field.view.middle_y_m(c)}; };
    const auto any = [&] { return cells[static_cast<size_t>(below(static_cast<int>(cells.size())))]; };
    const Cell from = any();
    const Place wanted[] = {middle(any()), middle(any())};
    const double reach = 0.3 * (1 + below(5));
    const Disc area{middle(from), 1.5}, seen{wanted[0], 0.5};
    const auto is_unknown = [&](int column, int row) {
      return field.view.contains({column, row}) && field.view.cells.at(column, row) == kUnknownCell;
    };
    const auto least = [&](const auto& there) {
      int64_t cost = -1;
      for (const Cell& c : cells) {
        if (!there(c)) continue;
        const int64_t to = least_cost(free, field.view, {from.column, from.row}, {c.column, c.row});
        if (to >= 0 && (cost < 0 || to < cost)) cost = to;
      }
      return cost;
    };
    const auto check = [&](PathOutcome outcome, int64_t truth, size_t& found) {
      REQUIRE(outcome == (truth < 0 ? PathOutcome::no_way : PathOutcome::found));
      ++(truth < 0 ? none : found);
      if (truth >= 0) REQUIRE(planner.cost() == truth);
      if (truth >= 0) REQUIRE(planner.free(path));
    };
    const auto in_reach = [&](const Cell& c) {
      return Disc{wanted[0], reach}.contains(middle(c)) && Disc{wanted[1], reach}.contains(middle(c));
    };
    check(planner.plan_near(middle(from), wanted, reach, path), least(in_reach), near);
    const auto beside = [&](const Cell& c) {
      const int x = c.column, y = c.row;
      return !is_unknown(x, y) && area.contains(middle(c)) && !seen.contains(middle(c)) &&
             (is_unknown(x + 1, y) || is_unknown(x - 1, y) || is_unknown(x, y + 1) || is_unknown(x, y - 1));
    };
    check(planner.plan_to_unknown(middle(from), area, {&seen, 1}, path), least(beside), unknown);
  }
  CHECK(near >= takt::test::at_scale(30));
  CHECK(unknown >= takt::test::at_scale(30));
  CHECK(none >= takt::test::at_scale(30));
}

TEST_CASE("obstacles grow as the definition says, and every way costs what Dijkstra's does") {
  std::mt19937 random(takt::test::seed(3));
  const auto below = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
  PathPlanner planners[] = {{600, {0, 3}}, {600, {0.1, 3}}, {600, {0.4, 3}}};
  constexpr double kClearance_m[] = {0, 0.1, 0.4};
  size_t found = 0, none = 0, pieces = 0;
  std::vector<Place> path;
  for (int round = 0; round < takt::test::rounds(300); ++round) {
    CAPTURE(round);
    const int width = 3 + below(22), height = 3 + below(22);
    const auto which = static_cast<size_t>(below(3));
    const RandomField field(random, width, height, 0.25 / (1 + 4.0 * static_cast<double>(which)), 0.3 * below(2));
    PathPlanner& planner = planners[which];
    REQUIRE(planner.look(field.view));
    std::map<Key, bool> free;
    std::vector<Cell> places;
    for (int row = 0; row < height; ++row)
      for (int column = 0; column < width; ++column) {
        const bool b = blocked(field.view, {column, row}, kClearance_m[which]);
        REQUIRE(planner.blocked({column, row}) == b);
        free[{column, row}] = !b;
        if (!b) places.push_back({column, row});
      }
    for (int i = 0; i < 4 && !places.empty(); ++i) {
      const Cell from = places[static_cast<size_t>(below(static_cast<int>(places.size())))],
                 to = places[static_cast<size_t>(below(static_cast<int>(places.size())))];
      const Place a{field.view.middle_x_m(from) + 0.09, field.view.middle_y_m(from) - 0.09},
          b{field.view.middle_x_m(to) - 0.09, field.view.middle_y_m(to) + 0.07};
      const int64_t truth = least_cost(free, field.view, {from.column, from.row}, {to.column, to.row});
      const PathOutcome outcome = planner.plan(a, b, 0, path);
      REQUIRE(outcome == (truth < 0 ? PathOutcome::no_way : PathOutcome::found));
      ++(truth < 0 ? none : found);
      if (truth < 0) continue;
      REQUIRE(planner.cost() == truth);
      REQUIRE(planner.free(path));
      for (size_t p = 0; p + 1 < path.size(); ++p, ++pieces)  // in steps of 1 % of a piece
        for (int step = 0; step <= 100; ++step) {
          const double s = step / 100.0;
          const Cell cell = field.view.cell_of(path[p].x_m + s * (path[p + 1].x_m - path[p].x_m),
                                               path[p].y_m + s * (path[p + 1].y_m - path[p].y_m));
          REQUIRE(free.at({cell.column, cell.row}));
        }
      // To within reach of an occupied place: the cheapest of the cells there.
      const double reach = 0.25 * (1 + below(4));
      int64_t nearest = -1;
      for (const Cell& cell : places) {
        if (std::hypot(field.view.middle_x_m(cell) - b.x_m, field.view.middle_y_m(cell) - b.y_m) > reach) continue;
        const int64_t cost = least_cost(free, field.view, {from.column, from.row}, {cell.column, cell.row});
        if (cost >= 0 && (nearest < 0 || cost < nearest)) nearest = cost;
      }
      REQUIRE(planner.plan(a, b, reach, path) == (nearest < 0 ? PathOutcome::no_way : PathOutcome::found));
      if (nearest >= 0) REQUIRE(planner.cost() == nearest);
    }
  }
  CHECK(found >= takt::test::at_scale(500));
  CHECK(none >= takt::test::at_scale(50));
  CHECK(pieces >= takt::test::at_scale(1000));
}

namespace {

/// Drives as it is told, three jobs later.
struct LateRobot {
  takt::PlanarPose pose;
  Velocity now;
  std::array<Velocity, 3> on_their_way{};
  size_t steps = 0;
  void step(const Velocity& told, double dt_s) {
    now = std::exchange(on_their_way[steps++ % on_their_way.size()], told);
    pose = takt::compose(pose, {now.speed_m_s * dt_s, 0, now.turn_rad_s * dt_s});
  }
};

/// All around an occupied cell.
std::vector<Place> borders(const OccupancyView& view) {
  std::vector<Place> places;
  for (int row = 0; row < view.cells.height; ++row)
    for (int column = 0; column < view.cells.width; ++column)
      for (int i = 0; i < 16 && view.cells.at(column, row) > kHalfOccupied; ++i) {
        const double along = (i % 4) / 4.0 - 0.5;
        const double turned[4][2] = {{along, -0.5}, {0.5, along}, {-along, 0.5}, {-0.5, -along}};
        const auto& at = turned[i / 4];
        places.push_back({view.middle_x_m({column, row}) + at[0] * view.cell_m,
                          view.middle_y_m({column, row}) + at[1] * view.cell_m});
      }
  return places;
}

}  // namespace

TEST_CASE("what a way was planned round never keeps who drives it from standing, turning and driving on") {
  using namespace takt::obstacle_stop;
  const Footprint robot = footprint(kRobotWidth_m, kRobotLength_m, kMargin_m);
  constexpr Braking kBraking{1.0, 1.5, 0.35};  // the guard's parameters
  constexpr double kStep_s = 1.0 / 15;
  constexpr int kCells = 80;
  std::mt19937 random(takt::test::seed(11));
  const auto below = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
  PathPlanner planner(kCells * kCells, {robot.clearance_m(), 3});
  std::vector<Place> way;
  size_t ways = 0, steps = 0, at_rest = 0, moving = 0;
  double nearest_m = 10;
  for (int round = 0; round < takt::test::rounds(60); ++round) {
    const RandomField field(random, kCells, kCells, 0.003, 0, 0.1);
    REQUIRE(planner.look(field.view));
    const auto obstacles = borders(field.view);
    const auto any = [&] {
      Cell cell;
      do cell = {below(kCells), below(kCells)};
      while (planner.blocked(cell));
      return Place{field.view.middle_x_m(cell), field.view.middle_y_m(cell)};
    };
    const Place from = any();
    if (planner.plan(from, any(), 0, way) != PathOutcome::found) continue;
    ++ways;
    LateRobot late{{from.x_m, from.y_m, below(628) / 100.0}, {}};
    Pilot pilot({});
    REQUIRE(pilot.drive_to(way, below(628) / 100.0));
    do {
      const Velocity wanted = pilot.step(late.pose, kStep_s);
      const Velocity& judged = late.now.speed_m_s == 0 && late.now.turn_rad_s == 0 ? wanted : late.now;
      const Drive drive{judged.speed_m_s, judged.turn_rad_s};
      constexpr Drive kTurn{0, MotionLimits{}.turn_rad_s};
      const ProtectedField field_of_drive(robot, drive, stopping_time_s(drive, kBraking)),
          field_at_rest(robot, kTurn, stopping_time_s(kTurn, kBraking));
      const double c = std::cos(late.pose.theta_rad), s = std::sin(late.pose.theta_rad);
      bool stops = false, holds = false;
      for (const Place& place : obstacles) {
        const double dx = place.x_m - late.pose.x_m, dy = place.y_m - late.pose.y_m;
        const double x = s * dx - c * dy, y = c * dx + s * dy;
        nearest_m = std::min(nearest_m, std::hypot(dx, dy));
        stops |= field_of_drive.contains(x, y);
        holds |= field_at_rest.contains(x, y);
      }
      moving += stops;
      at_rest += holds;
      late.step(wanted, kStep_s);
    } while (++steps < 1'000'000 && !pilot.standing());
  }
  MESSAGE(ways << " ways, " << steps << " jobs, " << moving << " with something in the field of the drive, " << at_rest
               << " in that at rest; never nearer than " << nearest_m << " m");
  CHECK(ways >= takt::test::at_scale(40));
  CHECK(nearest_m >= robot.clearance_m());
  CHECK(at_rest == 0);
}

TEST_CASE("corners that follow each other closely do not throw a robot off its way") {
  const std::vector<Place> ways[] = {{{-0.85, 7.35}, {-2.85, 10.85}, {-2.85, 11.55}, {-2.75, 12.95}, {-2.65, 12.95}},
                                     {{4.35, 7.95}, {4.05, 12.25}, {4.05, 12.35}, {4.15, 12.35}, {4.15, 12.55}}};
  for (const std::vector<Place>& way : ways) {
    LateRobot late{{way[0].x_m, way[0].y_m, 1.6}, {}};
    Pilot pilot({});
    REQUIRE(pilot.drive_to(way));
    double farthest_m = 0;
    for (int step = 0; step < 2000 && !pilot.standing(); ++step) {
      late.step(pilot.step(late.pose, 1.0 / 15), 1.0 / 15);
      double nearest_m = 10;
      for (size_t i = 1; i < way.size(); ++i) {
        const double ux = way[i].x_m - way[i - 1].x_m, uy = way[i].y_m - way[i - 1].y_m;
        const double dx = late.pose.x_m - way[i - 1].x_m, dy = late.pose.y_m - way[i - 1].y_m;
        const double along = std::clamp((ux * dx + uy * dy) / (ux * ux + uy * uy), 0.0, 1.0);
        nearest_m = std::min(nearest_m, std::hypot(dx - along * ux, dy - along * uy));
      }
      farthest_m = std::max(farthest_m, nearest_m);
    }
    CHECK(pilot.standing());
    MESSAGE("never farther than " << farthest_m << " m from the way");
    CHECK(farthest_m < 0.05);
  }
}
