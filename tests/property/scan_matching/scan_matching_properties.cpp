// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>

#include "nodes/scan_matching/drive.hpp"
#include "nodes/scan_matching/occupancy_map.hpp"
#include "nodes/scan_matching/scan_matcher.hpp"
#include "tests/property_scale.hpp"

using namespace takt;
using namespace takt::scan_matching;

namespace {

struct Random {
  std::mt19937_64 engine;
  double operator()(double low, double high) { return std::uniform_real_distribution<>(low, high)(engine); }
  std::vector<SurfacePoint> points(size_t count, double half_m) {
    std::vector<SurfacePoint> out;
    for (size_t i = 0; i < count; ++i) {
      const double angle = (*this)(-3.1, 3.1);
      const bool flat = (*this)(0, 1) < 0.8;
      out.push_back(
          {(*this)(-half_m, half_m), (*this)(-half_m, half_m), flat ? std::cos(angle) : 0, flat ? std::sin(angle) : 0});
    }
    return out;
  }
};

}  // namespace

TEST_CASE("every cell of the field has the value of its nearest mapped cell, and every bound covers its blocks") {
  Random random{std::mt19937_64(test::seed(1))};
  for (int round = 0; round < test::rounds(20); ++round) {
    const double cell_m = random(0.03, 0.1), sigma_m = random(1, 3) * cell_m;
    ScoreField field(random(1, 3), cell_m, sigma_m);
    const auto points = random.points(static_cast<size_t>(random(0, 40)), 4);
    field.draw(random.points(30, 4), 1, 1);  // leaves nothing behind
    field.draw(points, random(-0.5, 0.5), random(-0.5, 0.5));
    const int radius = static_cast<int>(3 * sigma_m / cell_m);
    bool equal = true, bounded = true;
    for (int row = 0; row < field.cells(); ++row)
      for (int column = 0; column < field.cells(); ++column) {
        double nearest = 1e9;
        for (const SurfacePoint& p : points) {
          const int c = field.column(p.x_m), r = field.row(p.y_m);
          if (std::min(c, r) < radius || std::max(c, r) >= field.cells() - radius) continue;
          nearest = std::min(nearest, std::pow(c - column, 2) + std::pow(r - row, 2));
        }
        const double scaled = nearest * cell_m * cell_m / (sigma_m * sigma_m);
        const double value = 255 * std::exp(-scaled / 2);
        const double off = field.at(column, row) - (scaled > 9 ? 0 : value);
        // Where distance and sigma meet in a rounding, either answer is right.
        equal &= std::abs(off) <= 0.5 + 1e-9 || std::abs(scaled - 9) < 1e-9;
        for (int y = std::max(0, row - 7); y <= row; ++y)
          for (int x = std::max(0, column - 7); x <= column; ++x) bounded &= field.bound(x, y) >= field.at(column, row);
      }
    CHECK(equal);
    CHECK(bounded);
  }
}

TEST_CASE("the search finds what trying every candidate finds, equal scores included") {
  Random random{std::mt19937_64(test::seed(2))};
  size_t moved = 0;
  for (int round = 0; round < test::rounds(24); ++round) {
    CAPTURE(round);
    SearchParameters p;
    p.reach_m = random(0.1, 0.6);
    p.reach_rad = random(0.02, 0.2);
    p.step_rad = random(0.01, 0.03);
    p.prior = round % 3 == 0 ? 0 : random(0, 0.05);  // 0: plateaus
    const double cell_m = random(0.04, 0.08);
    ScoreField field(6, cell_m, 2 * cell_m);
    const bool room = round % 2 == 0;
    std::vector<SurfacePoint> points;
    if (room) {
      std::vector<float> ranges;
      DriveParameters drive;
      cast(furnished_room(test::seed(static_cast<uint64_t>(round))),
           {random(-0.5, 0.5), random(-0.5, 0.5), random(-3, 3)}, drive, random.engine, ranges);
      points_of({-drive.field_rad / 2, drive.field_rad / 180, ranges, {}}, 15, points);
    } else {
      points = random.points(60, 3);
    }
    const PlanarPose truth{random(-0.3, 0.3), random(-0.3, 0.3), random(-3, 3)};
    std::vector<SurfacePoint> mapped;
    for (const SurfacePoint& point : points) mapped.push_back(transformed(truth, point));
    field.draw(mapped, 0, 0);
    CorrelativeSearch search(points.size(), p, cell_m);
    const Expected expected{
        {truth.x_m + random(-0.3, 0.3), truth.y_m + random(-0.3, 0.3), truth.theta_rad + random(-0.1, 0.1)},
        random(0.05, 0.5),
        random(0.02, 0.3)};
    const Found fast = search.find(field, points, expected);
    const Found slow = search.find_reference(field, points, expected);
    CHECK(fast == slow);
    CHECK(fast.penalty == slow.penalty);
    CHECK(fast.robot_in_map.x_m == slow.robot_in_map.x_m);
    CHECK(fast.robot_in_map.theta_rad == slow.robot_in_map.theta_rad);
    moved += std::hypot(fast.robot_in_map.x_m - expected.robot_in_map.x_m,
                        fast.robot_in_map.y_m - expected.robot_in_map.y_m) > cell_m;
  }
  CHECK(moved >= test::at_scale(8));
}

TEST_CASE("the nearest point is the one that looking at every point finds; so is the refined pose, bit by bit") {
  Random random{std::mt19937_64(test::seed(3))};
  size_t found = 0;
  for (int round = 0; round < test::rounds(20); ++round) {
    MapParameters p;
    p.keyframes = 1 + round % 4;
    p.range_max_m = 3;
    p.reach_m = 0.5;
    p.gate_m = random(0.1, 0.6);
    LocalMap map(80, p);
    PlanarPose pose;
    for (int i = 0; i < 6; ++i) {
      pose = {random(-0.5, 0.5), random(-0.5, 0.5), random(-3, 3)};
      map.add(pose, random.points(80, 3.5));  // some outside of the map
    }
    CHECK(map.points().size() == 80 * static_cast<size_t>(p.keyframes));
    for (SurfacePoint& q : random.points(400, 6)) {
      if (!q.has_normal()) continue;
      const SurfacePoint* fast = map.nearest(q);
      CHECK(fast == map.nearest_reference(q));
      found += fast != nullptr;
    }
    const auto points = random.points(80, 3);
    const Expected expected{pose, 0.2, 0.1};
    const Refined fast = refine(map, points, expected, pose, {}),
                  slow = refine(map, points, expected, pose, {}, &LocalMap::nearest_reference);
    CHECK(fast.robot_in_map.x_m == slow.robot_in_map.x_m);
    CHECK(fast.robot_in_map.theta_rad == slow.robot_in_map.theta_rad);
    CHECK(fast.covariance == slow.covariance);
    CHECK(fast.paired == slow.paired);
  }
  CHECK(found >= test::at_scale(500));
}

TEST_CASE("the occupancy map equals one of endless cells, sweep by sweep") {
  Random random{std::mt19937_64(test::seed(4))};
  for (int round = 0; round < test::rounds(8); ++round) {
    OccupancyParameters p;
    p.cell_m = random(0.05, 0.3);
    p.window_m = random(3, 8);
    p.range_max_m = random(2, 10);
    p.up = static_cast<int>(random(50, 400));
    p.down = static_cast<int>(random(50, 400));
    OccupancyMap map(p);
    std::map<std::pair<int64_t, int64_t>, int> endless;
    PlanarPose robot{random(-20, 20), random(-20, 20), random(-3, 3)};
    for (int step = 0; step < 12; ++step) {
      robot = compose(robot, {random(-0.6, 0.6), random(-0.6, 0.6), random(-0.5, 0.5)});
      std::vector<float> ranges;
      for (int i = 0; i < 60; ++i) ranges.push_back(static_cast<float>(random(0, 1) < 0.1 ? 0 : random(0.05, 12)));
      const Sweep sweep{random(-3, 0), 0.05, ranges, {random(-0.3, 0.3), random(-0.3, 0.3), random(-1, 1)}};
      map.centre(robot.x_m, robot.y_m);
      map.add(robot, sweep);

      const auto column0 = std::llround(map.origin_x_m() / p.cell_m), row0 = std::llround(map.origin_y_m() / p.cell_m);
      const auto inside = [&](const std::pair<int64_t, int64_t>& c) {
        return c.first >= column0 && c.first < column0 + map.side() && c.second >= row0 && c.second < row0 + map.side();
      };
      std::erase_if(endless,
                    [&](const auto& cell) { return !inside(cell.first); });  // what left the window is forgotten
      std::set<std::pair<int64_t, int64_t>> passed, ended;
      const PlanarPose sensor = compose(robot, sweep.sensor_in_robot);
      const auto cell = [&](double x, double y) {
        return std::pair{static_cast<int64_t>(std::floor(x / p.cell_m)),
                         static_cast<int64_t>(std::floor(y / p.cell_m))};
      };
      const auto from = cell(sensor.x_m, sensor.y_m);
      for (size_t i = 0; i < ranges.size(); ++i) {
        if (ranges[i] <= 0) continue;
        const double angle = sensor.theta_rad + sweep.first_angle_rad + static_cast<double>(i) * sweep.step_rad;
        const double length = std::min<double>(ranges[i], p.range_max_m);
        const auto to = cell(sensor.x_m - length * std::sin(angle), sensor.y_m + length * std::cos(angle));
        const auto n = std::max(std::abs(to.first - from.first), std::abs(to.second - from.second));
        for (int64_t k = 0; k < n; ++k) {
          const double share = static_cast<double>(k) / static_cast<double>(n);
          passed.insert(
              {from.first + std::llround(std::floor(share * static_cast<double>(to.first - from.first) + 0.5 + 1e-12)),
               from.second +
                   std::llround(std::floor(share * static_cast<double>(to.second - from.second) + 0.5 + 1e-12))});
        }
        if (ranges[i] <= p.range_max_m) ended.insert(to);
      }
      const auto change = [&](const std::pair<int64_t, int64_t>& c, int by) {
        if (!inside(c)) return;
        const auto known = endless.try_emplace(c, 500).first;
        known->second = std::clamp(known->second + by, 0, 1000);
      };
      for (const auto& c : passed)
        if (!ended.contains(c)) change(c, -p.down);
      for (const auto& c : ended) change(c, p.up);
      bool equal = true;
      for (int row = 0; row < map.side(); ++row)
        for (int column = 0; column < map.side(); ++column) {
          const auto known = endless.find({column0 + column, row0 + row});
          equal &= map.cells().at(column, row) == (known == endless.end() ? kUnknown : known->second);
        }
      CHECK(equal);
    }
  }
}
