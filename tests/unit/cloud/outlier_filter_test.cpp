// SPDX-License-Identifier: Apache-2.0
#include "nodes/cloud/outlier_filter.hpp"

#include <doctest/doctest.h>

#include <limits>
#include <vector>

#include "rt/memory/memory_use.hpp"
#include "rt/msg/point.hpp"

using namespace takt::cloud;
using takt::Colour;
using takt::Point;

TEST_CASE("a point does not count itself; the radius is inclusive; decisions come before deletions") {
  // A chain 0.2 m apart: inner points have two neighbours, ends one. With n_min 2 only the ends go, whatever the order.
  std::vector<Point> chain;
  for (int i = 0; i < 10; ++i) chain.push_back({0.25f * static_cast<float>(i), 0, 0});
  std::vector<uint8_t> keep(chain.size());
  OutlierFilter filter(chain.size());
  CHECK(filter.filter(chain, {0.25, 2}, keep) == 8);
  CHECK(keep.front() == 0);
  CHECK(keep.back() == 0);
  CHECK(filter.filter(chain, {0.25, 1}, keep) == 10);
  CHECK(filter.filter(chain, {0.24, 1}, keep) == 0);
  CHECK(filter.filter(chain, {0.24, 0}, keep) == 10);
}

TEST_CASE("points that are not finite are dropped and do not count") {
  const float nan = std::numeric_limits<float>::quiet_NaN(), infinite = std::numeric_limits<float>::infinity();
  std::vector<Point> points{{0, 0, 0}, {nan, 0, 0}, {0.1f, 0, 0}, {0, infinite, 0}, {0, 0, 1e30f}};
  std::vector<uint8_t> keep(points.size());
  OutlierFilter filter(points.size());
  CHECK(filter.filter(points, {0.2, 1}, keep) == 2);
  CHECK(keep == std::vector<uint8_t>{1, 0, 1, 0, 0});
  CHECK(filter.filter(std::span(points).subspan(1, 1), {0.2, 0}, std::span(keep).first(1)) == 0);
  CHECK(filter.filter({}, {0.2, 0}, {}) == 0);
}

TEST_CASE("points beyond the capacity are not kept") {
  std::vector<Point> points(20, Point{1, 2, 3});
  std::vector<uint8_t> keep(points.size(), 9);
  OutlierFilter filter(12);
  CHECK(filter.capacity() == 12);
  CHECK(filter.filter(points, {0.2, 5}, keep) == 12);
  CHECK(keep[11] == 1);
  CHECK(keep[12] == 0);
}

TEST_CASE("compact keeps order and colours; n_min scales with the points") {
  std::vector<Point> points{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}};
  std::vector<Colour> colours{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}};
  const std::vector<uint8_t> keep{0, 1, 0, 1};
  CHECK(compact(points, colours, keep) == 2);
  CHECK(points[0].x == 1);
  CHECK(points[1].x == 3);
  CHECK(colours[1].b == 3);
  CHECK(scaled_n_min(100, 300000) == 25);
  CHECK(scaled_n_min(100, 10) == 1);
}

TEST_CASE("filter allocates nothing") {
  if (!takt::counting_allocations()) {
    MESSAGE("NOT RUN: this program does not count allocations (sanitizer)");
    return;
  }
  std::vector<Point> points;
  for (int i = 0; i < 5000; ++i)
    points.push_back(
        {0.01f * static_cast<float>(i % 71), 0.01f * static_cast<float>(i % 67), 0.02f * static_cast<float>(i % 61)});
  std::vector<uint8_t> keep(points.size());
  OutlierFilter filter(points.size());
  const uint64_t before = takt::thread_memory_use().allocations;
  CHECK(filter.filter(points, {0.1, 3}, keep) > 0);
  CHECK(takt::thread_memory_use().allocations == before);
}
