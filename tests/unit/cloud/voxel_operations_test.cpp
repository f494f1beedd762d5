// SPDX-License-Identifier: Apache-2.0
#include "nodes/cloud/voxel_operations.hpp"

#include <doctest/doctest.h>

#include <limits>
#include <numeric>
#include <set>
#include <vector>

#include "rt/memory/memory_use.hpp"
#include "rt/msg/point.hpp"

using namespace takt::cloud;
using takt::Colour;
using takt::Point;

namespace {

constexpr double kEdge = 0.5;  // a binary fraction, so that means of voxel centres are exact

Point at(int x, int y, int z) {
  const auto centre = VoxelSize(kEdge).centre_of({x, y, z});
  return {static_cast<float>(centre[0]), static_cast<float>(centre[1]), static_cast<float>(centre[2])};
}

/// One point in the centre of each voxel of a square about the origin, in layer 0.
std::vector<Point> plane(int half_width) {
  std::vector<Point> points;
  for (int y = -half_width; y <= half_width; ++y)
    for (int x = -half_width; x <= half_width; ++x) points.push_back(at(x, y, 0));
  return points;
}

struct Result {
  std::vector<Point> points;
  std::vector<Colour> colours;
  CloudBuffer buffer;

  explicit Result(size_t capacity) : points(capacity), colours(capacity), buffer(points, colours) {}
  /// Layers that have a point in the column above the middle of the plane.
  std::multiset<int> layers() const {
    std::multiset<int> found;
    for (const Point& p : buffer.view().points) {
      const auto voxel = VoxelSize(kEdge).voxel_of(p);
      if (voxel.x == 0 && voxel.y == 0) found.insert(voxel.z);
    }
    return found;
  }
};

Result smoothed(const std::vector<Point>& points, double t_occ) {
  VoxelGrid grid(points.size());
  grid.fill({points, {}}, kEdge);
  Result result(10 * points.size());
  smooth(grid, t_occ, result.buffer);
  return result;
}

}  // namespace

TEST_CASE("oracle 1: the kernel sums to 1; a full plane answers with 0.65 in its layer and 0.175 beside it") {
  CHECK(std::accumulate(kSmoothingKernel.begin(), kSmoothingKernel.end(), 0) == kKernelSum);
  const auto points = plane(5);
  using Layers = std::multiset<int>;
  CHECK(smoothed(points, 0.651).layers() == Layers{});
  CHECK(smoothed(points, 0.65).layers() == Layers{0});
  CHECK(smoothed(points, 0.1751).layers() == Layers{0});
  // What the voxels beside it hold then is the mean of the plane's points, which lies in the plane.
  CHECK(smoothed(points, 0.1749).layers() == Layers{0, 0, 0});
  CHECK(smoothed(points, 0).layers() == Layers{0, 0, 0});
}

TEST_CASE("smoothing leaves a plane where it is and flattens a bump") {
  auto points = plane(5);
  const Result flat = smoothed(points, 0.25);
  size_t inner = 0;
  for (const Point& p : flat.buffer.view().points) {
    CHECK(p.z == at(0, 0, 0).z);
    inner += std::abs(p.x) < 2 && std::abs(p.y) < 2;
  }
  CHECK(inner == 64);
  points[points.size() / 2].z += 0.1f;  // the middle one, within its voxel
  const Result bump = smoothed(points, 0.25);
  for (const Point& p : bump.buffer.view().points)
    if (VoxelSize(kEdge).voxel_of(p) == VoxelIndex{0, 0, 0})
      CHECK(p.z == doctest::Approx(static_cast<double>(at(0, 0, 0).z) + 0.1 * 10 / 26));
}

TEST_CASE("smoothing weighs voxels with their points and mixes colours") {
  // Two points in one voxel, one in the next: seen from the first 2 * 10 + 1 * 3, from the second 2 * 3 + 1 * 10.
  const std::vector<Point> points{at(0, 0, 0), at(0, 0, 0), at(1, 0, 0)};
  const std::vector<Colour> colours{{0, 0, 0}, {0, 0, 0}, {230, 23, 0}};
  VoxelGrid grid(points.size());
  grid.fill({points, colours}, kEdge);
  Result result(20);
  smooth(grid, 0.25, result.buffer);
  REQUIRE(result.buffer.size() == 2);
  CHECK(result.colours[0].b == 30);
  CHECK(result.colours[0].g == 3);
  CHECK(result.points[0].x == doctest::Approx((20 * 0.25 + 3 * 0.75) / 23));
  CHECK(result.colours[1].b == 144);  // 143.75
}

TEST_CASE("reduction gives mean position and colour, in a settled order") {
  const std::vector<Point> points{{5.1f, 0.1f, 0.1f}, {0.1f, 0.1f, 0.6f}, {0.3f, 0.2f, 0.1f}, {5.2f, 0.3f, 0.3f},
                                  {0.2f, 0.6f, 0.1f}, {-0.1f, 0, 0},      {5.3f, 0.2f, 0.2f}};
  const std::vector<Colour> colours{{1, 0, 10}, {7, 7, 7}, {1, 2, 3}, {2, 0, 20}, {9, 9, 9}, {4, 4, 4}, {2, 0, 30}};
  VoxelGrid grid(points.size());
  grid.fill({points, colours}, 0.5);
  Result result(points.size());
  reduce(grid, result.buffer);
  REQUIRE(result.buffer.size() == 5);
  // Brick by brick, in each by z, then y, then x: whatever the order of the points.
  CHECK(result.points[0].x == -0.1f);
  CHECK(result.colours[0].g == 4);
  CHECK(result.points[1].x == 0.3f);
  CHECK(result.points[2].y == 0.6f);
  CHECK(result.points[3].z == 0.6f);
  CHECK(result.points[4].x == doctest::Approx(5.2));
  CHECK(result.points[4].y == doctest::Approx(0.2));
  CHECK(result.colours[4].b == 2);  // 1.67
  CHECK(result.colours[4].r == 20);
}

TEST_CASE("interpolation closes a hole with the weighted mean of its nearest points") {
  std::vector<Point> points;
  for (int i = 0; i < 125; ++i)
    if (i != 62) points.push_back(at(i % 5 - 2, i / 5 % 5 - 2, i / 25 - 2));  // the middle one is missing
  VoxelGrid grid(points.size());
  const auto filled = [&](int n_adj, int k, double reach) {
    grid.fill({points, {}}, kEdge);
    Result result(2 * points.size());
    interpolate(grid, {kEdge, n_adj, k, reach}, result.buffer);
    return result;
  };
  // Only the hole has 26 neighbours; the six that share a face with it are its nearest.
  const Result hole = filled(26, 6, 2);
  REQUIRE(hole.buffer.size() == points.size() + 1);
  const Point& made = hole.points[points.size()];
  CHECK(made.x == at(0, 0, 0).x);
  CHECK(made.y == at(0, 0, 0).y);
  CHECK(made.z == at(0, 0, 0).z);
  CHECK(filled(26, 6, 1).buffer.size() == points.size() + 1);  // they are one edge away,
  CHECK(filled(26, 6, 0.99).buffer.size() == points.size());   // not less,
  CHECK(filled(26, 7, 1.41).buffer.size() == points.size());   // and the seventh sqrt(2)
  CHECK(filled(26, 7, 1.42).buffer.size() == points.size() + 1);
}

TEST_CASE("voxels over and under a plane are gaps, too, and filled within it (R-2.2, taken at its word)") {
  const auto points = plane(3);
  VoxelGrid grid(points.size());
  grid.fill({points, {}}, kEdge);
  Result result(10 * points.size());
  interpolate(grid, {kEdge, 4, 4, 2}, result.buffer);
  CHECK(result.layers() == std::multiset<int>{0, 0, 0});
}

TEST_CASE("interpolation takes the colours of the nearest along, nearer ones weigh more") {
  // Seen from voxel (1, 0, 0): the first one edge away, the other two 1.5.
  const std::vector<Point> points{at(0, 0, 0), {1.5f, 0.25f, 0.25f}, {1.5f, 0.25f, 0.25f}};
  const std::vector<Colour> colours{{0, 0, 100}, {0, 0, 200}, {0, 0, 200}};
  VoxelGrid grid(points.size());
  grid.fill({points, colours}, kEdge);
  Result result(200);
  interpolate(grid, {kEdge, 1, 2, 2}, result.buffer);
  const auto view = result.buffer.view();
  bool found = false;
  for (size_t i = 2; i < view.points.size(); ++i)
    if (view.colours[i].r == 140) {  // (100 / 1 + 200 / 1.5) / (1 / 1 + 1 / 1.5)
      CHECK(view.points[i].x == doctest::Approx((0.25 + 1.5 / 1.5) / (1 + 1 / 1.5)));
      found = true;
    }
  CHECK(found);
}

TEST_CASE("what has no place or no room is counted") {
  const float nan = std::numeric_limits<float>::quiet_NaN(), infinite = std::numeric_limits<float>::infinity();
  const std::vector<Point> points{{0, 0, 0}, {nan, 0, 0}, {0, infinite, 0}, {0, 0, 3e6f}, {1, 0, 0}, {2, 0, 0}};
  VoxelGrid grid(5);
  grid.fill({points, {}}, kEdge);
  CHECK(grid.unusable() == 3);
  CHECK(grid.lost() == 1);
  Result result(1);
  reduce(grid, result.buffer);
  CHECK(result.buffer.size() == 1);
  CHECK(result.buffer.lost() == 1);
  grid.fill({}, kEdge);
  CHECK(grid.voxels().empty());
  CHECK(grid.unusable() == 0);
  CHECK_THROWS_WITH(VoxelGrid((1u << 24) + 1), "a voxel grid holds at most 2^24 points");
}

TEST_CASE("voxels begin at multiples of their edge, on either side of the origin") {
  const VoxelSize size(0.5);
  CHECK(size.voxel_of({0, 0.49f, 0.5f}) == VoxelIndex{0, 0, 1});
  CHECK(size.voxel_of({-0.0f, -0.01f, -0.5f}) == VoxelIndex{0, -1, -1});
  CHECK(size.voxel_of({-0.51f, 999999, 0}) == VoxelIndex{-2, 1999998, 0});
  CHECK(size.holds({0, 1e6f, -1e6f}));
  CHECK_FALSE(size.holds({0, 0, 1.1e6f}));
  CHECK_FALSE(VoxelSize(0.01).holds({0, 0, 40001}));
}

TEST_CASE("no operation on voxels allocates") {
  if (!takt::counting_allocations()) {
    MESSAGE("NOT RUN: this program does not count allocations (sanitizer)");
    return;
  }
  const auto points = plane(20);
  VoxelGrid grid(points.size());
  Result result(5 * points.size());
  const uint64_t before = takt::thread_memory_use().allocations;
  grid.fill({points, {}}, kEdge);
  smooth(grid, 0.25, result.buffer);
  reduce(grid, result.buffer);
  interpolate(grid, {kEdge, 4, 4, 2}, result.buffer);
  CHECK(takt::thread_memory_use().allocations == before);
  CHECK(result.buffer.size() > 2 * points.size());
}
