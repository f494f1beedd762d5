// SPDX-License-Identifier: Apache-2.0
#include "nodes/mapping_3d/tile_map.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "nodes/mapping_3d/generated_world.hpp"
#include "rt/memory/memory_use.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/point.hpp"
#include "tests/going_on.hpp"

using namespace takt;
using namespace takt::mapping_3d;

namespace {

Transform at(double x, double y) { return robot_at(x, y, 0); }

/// Points 0.1 m apart on a square of 2 x 2 m around the sensor, at that height.
std::vector<Point> square(float z = 0.52f) {
  std::vector<Point> points;
  for (int i = 0; i < 20; ++i)
    for (int k = 0; k < 20; ++k)
      points.push_back({-0.975f + 0.1f * static_cast<float>(i), -0.975f + 0.1f * static_cast<float>(k), z});
  return points;
}

double farthest_from(const TileMap& map, double x) {
  double farthest = 0;
  map.for_each([&](const Position& p, const MapPoint&) { farthest = std::max(farthest, std::abs(p.x_m - x)); });
  return farthest;
}

}  // namespace

TEST_CASE("the same cloud again adds nothing; where two tiles meet neither does") {
  TileMap map({});
  map.add({square(), {}}, at(0, 0), 1);
  CHECK(map.points() == 400);
  map.add({square(), {}}, at(0, 0), 2);
  CHECK(map.points() == 400);
  map.add({square(), {}}, at(0, 0.5), 3);
  CHECK(map.points() == 500);
  CHECK(map.tiles() == 1);
  map.add({square(), {}}, at(0, 4), 4);  // a tile of its own
  CHECK(map.tiles() == 2);
  CHECK(map.points() == 900);
  map.add({square(), {}}, at(0, 2.2), 5);  // between: what either side knows is not new
  const size_t between = map.points();
  CHECK(between == 900 + 20 * (20 - 3 - 2));
  map.add({square(), {}}, at(0, 2.2), 6);
  CHECK(map.points() == between);
}

TEST_CASE("a point is the mean of what was seen, in place and colour") {
  TileMap map({});
  const std::vector<Point> first{{0.01f, 0.01f, 0.51f}}, second{{0.03f, 0.01f, 0.51f}};
  const std::vector<Colour> dark{{10, 20, 30}}, light{{30, 40, 50}};
  map.add({first, dark}, at(0, 0), 1);
  map.add({second, light}, at(0, 0), 2);
  REQUIRE(map.points() == 1);
  map.for_each([](const Position& p, const MapPoint& point) {
    CHECK(p.x_m == doctest::Approx(0.02));
    CHECK(int{point.colour.b} == 20);
    CHECK(int{point.colour.r} == 40);
    CHECK(int{point.seen} == 2);
  });
}

TEST_CASE("memory is bounded: the tile that is farthest away makes room, nothing is allocated") {
  MapParameters p;
  p.tiles = 4;
  p.tile_points = 1000;
  TileMap map(p);
  const std::vector<Point> points = square();
  const uint64_t before = thread_memory_use().allocations;
  for (int step = 0; step < 200; ++step) map.add({points, {}}, at(step, 0), step);
  if (counting_allocations()) CHECK(thread_memory_use().allocations == before);
  CHECK(map.tiles() == 4);
  CHECK(map.points() <= 4 * p.tile_points);
  CHECK(map.dropped() > 1000);
  CHECK(farthest_from(map, 199) < 20);  // what is near has stayed
}

TEST_CASE("a full tile gives way to another one; points beyond any voxel are left out") {
  MapParameters p;
  p.tile_points = 150;
  TileMap map(p);
  map.add({square(), {}}, at(0, 0), 1);
  CHECK(map.points() == 400);
  CHECK(map.tiles() == 3);
  const std::vector<Point> odd{{NAN, 0, 0}, {1e9f, 0, 0}};
  map.add({odd, {}}, at(0, 0), 2);
  CHECK(map.points() == 400);
}

TEST_CASE("what is looked through goes, once it was missing more often than seen; the rest stays") {
  const DepthCamera camera{40, 40, 40, 19.5, 19.5, 0.01};
  std::vector<float> depth(camera.pixels(), 4.0f);
  TileMap map({});
  const std::vector<Point> points{{0, 0, 2}, {0, 0, 3.9f}, {0, 0, 5}, {30, 0, 2}, {0, 0, -1}};
  for (int i = 0; i < 3; ++i) map.add({points, {}}, {}, i);
  CHECK(map.points() == 5);
  const DepthView view{camera, {}, depth, {}};
  for (int i = 0; i < 3; ++i) {
    map.clear_seen_through(view, 0.01, 0.1, 10);
    CHECK(map.points() == 5);
  }
  map.clear_seen_through(view, 0.01, 0.1, 10);
  CHECK(map.points() == 4);  // the one at 2 m; at 3.9 m within the tolerance, the others hidden, beside, behind
  map.add({points, {}}, {}, 9);
  CHECK(map.points() == 5);  // back again
  // One of the nine pixels around it sees something near: an edge.
  for (size_t v = 18; v < 21; ++v) depth[v * 40 + 21] = 2.0f;
  for (int i = 0; i < 20; ++i) map.clear_seen_through(view, 0.01, 0.1, 10);
  CHECK(map.points() == 5);
}

TEST_CASE("a map that goes on from what was remembered is the same point by point") {
  const DepthCamera camera{40, 40, 40, 19.5, 19.5, 0.01};
  std::vector<float> depth(camera.pixels(), 3.0f);
  MapParameters p;
  p.tiles = 5;
  p.tile_points = 600;
  p.tile_m = 1;
  auto straight = std::make_unique<TileMap>(p), interrupted = std::make_unique<TileMap>(p);
  std::mt19937 random(1);
  for (int step = 0; step < 120; ++step) {
    std::vector<Point> points = square(0.5f + 0.02f * static_cast<float>(step % 7));
    for (Point& point : points) point.x += static_cast<float>(random() % 1000) * 1e-4f;  // also to borders of voxels
    Transform sensor = at(0.1 * (step % 70), 0);
    for (TileMap* map : {straight.get(), interrupted.get()}) {
      map->add({points, {}}, sensor, step);
      int tiles = 0;
      if (step % 5 == 0)
        map->clear_seen_through({camera, sensor, depth, {}}, 0.01, 0.1, 10, [&] { return tiles++ < 2; });
      if (step % 30 == 29) map->correct(step - 20, step, sensor, at(sensor.x + 0.013, 0.02));
      if (step % 4 == 0) map->join_laid([&] { return tiles++ < 4; });
    }
    interrupted = test::going_on(*interrupted, std::make_unique<TileMap>(p));
    std::vector<Position> places[2];
    for (const auto& [map, into] : {std::pair{straight.get(), &places[0]}, {interrupted.get(), &places[1]}})
      map->for_each([&, into = into](const Position& at, const MapPoint&) { into->push_back(at); });
    REQUIRE(places[0].size() == places[1].size());
    for (size_t i = 0; i < places[0].size(); ++i) REQUIRE(places[0][i].x_m == places[1][i].x_m);
  }
  CHECK(straight->dropped() == interrupted->dropped());
}

TEST_CASE("a map that has time for a few tiles a view holds in the end what one without haste does") {
  const DepthCamera camera{40, 40, 40, 19.5, 19.5, 0.01};
  std::vector<float> depth(camera.pixels(), 9.0f);
  MapParameters p;
  p.tile_m = 0.5;
  TileMap hasty(p), patient(p);
  for (TileMap* map : {&hasty, &patient})
    for (int i = 0; i < 6; ++i) {
      const std::vector<Point> ahead{{-0.52f + 0.2f * static_cast<float>(i), 0.12f, static_cast<float>(4 - i)}};
      Transform sensor;
      sensor.z = i;
      map->add({ahead, {}}, sensor, i);
    }
  REQUIRE(hasty.tiles() == 6);
  const DepthView view{camera, {}, depth, {}};
  size_t views = 0;
  for (; views < 20 && hasty.points() > 0; ++views) {
    int tiles = 0;
    CHECK_FALSE(hasty.clear_seen_through(view, 0, 0.1, 10, [&] { return tiles++ < 2; }));
  }
  CHECK(views == 6);  // each of the six tiles is held against two views: one point, seen once
  CHECK(patient.clear_seen_through(view, 0, 0.1, 10));
  CHECK(patient.points() == 6);
  CHECK(patient.clear_seen_through(view, 0, 0.1, 10));
  CHECK(patient.points() == 0);
}

TEST_CASE("a correction moves each tile by its share of the error, and joins what then lies in one place") {
  MapParameters p;
  p.tile_m = 1;
  TileMap map(p);
  const std::vector<Point> here{{0.01f, 0.01f, 0.51f}};
  map.add({here, {}}, at(0, 0), 0);
  map.add({here, {}}, at(2, 0), 100);
  map.add({here, {}}, at(4, 0), 200);
  Transform actual = at(4, 1);
  actual.qw = std::cos(0.1), actual.qz = std::sin(0.1);
  map.correct(0, 200, at(4, 0), actual);
  std::vector<double> x, y;
  map.for_each([&](const Position& place, const MapPoint&) { x.push_back(place.x_m), y.push_back(place.y_m); });
  REQUIRE(y.size() == 3);
  CHECK(std::abs(y[0] - 0.01) < 1e-3);
  CHECK(std::abs(y[1] - 0.51) < 0.01);
  CHECK(std::abs(y[2] - 1.01) < 0.01);
  // A round that came back to where it began, believed to have ended 4 m beside it.
  TileMap round(p);
  const std::vector<Point> points = square();
  round.add({points, {}}, at(0, 0), 0);
  round.add({points, {}}, at(4, 0), 100);
  CHECK(round.points() == 800);
  round.correct(0, 100, at(4, 0), at(0, 0));
  CHECK_FALSE(round.join_laid([] { return false; }));
  CHECK(round.points() == 800);
  CHECK(round.join_laid());
  CHECK(round.points() == 400);
}

TEST_CASE("a map from a file lies where it was, in tiles of its own") {
  TileMap map({});
  std::vector<Point> points;
  for (int i = 0; i < 300; ++i) points.push_back({0.1f * static_cast<float>(i) + 0.02f, -7.02f, 0.51f});
  map.load({points, {}});
  CHECK(map.points() == 300);
  CHECK(map.tiles() >= 5);
  double worst = 0;
  map.for_each([&](const Position& p, const MapPoint&) { worst = std::max(worst, std::abs(p.y_m + 7.02)); });
  CHECK(worst < 1e-4);
}
