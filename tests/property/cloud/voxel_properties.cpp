// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>
#include <random>
#include <tuple>
#include <vector>

#include "nodes/cloud/cloud_filter.hpp"
#include "nodes/cloud/voxel_reference.hpp"
#include "rt/msg/point.hpp"
#include "tests/property_scale.hpp"

using namespace takt::cloud;
using takt::Colour;
using takt::Point;

namespace {

constexpr size_t kMost = 700;

/// Planes, clumps and single points, some on the borders of voxels, some of no use.
Cloud random_cloud(std::mt19937& random, double edge) {
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution<>(low, high)(random); };
  const auto below = [&](int n) { return std::uniform_int_distribution<>(0, n - 1)(random); };
  Cloud cloud;
  const double size = edge * uniform(2, 30), off = below(4) == 0 ? 1000 * edge * uniform(-100, 100) : 0;
  const bool coloured = below(3) != 0, on_lattice = below(4) == 0;
  const int kind = below(3), vast = below(4);
  for (int n = below(kMost); n > 0; --n) {
    double p[3] = {uniform(-size, size), uniform(-size, size), uniform(-size, size)};
    if (kind == 0) p[2] = edge * uniform(-0.6, 0.6);
    if (kind == 1)
      for (double& v : p) v = std::normal_distribution<>(0, 2 * edge)(random);
    if (on_lattice)
      for (double& v : p) v = edge / 2 * std::round(v / edge);
    if (vast == 0 && below(3) == 0) {  // so far away that bricks share buckets of the grid, some with their neighbours
      p[0] -= 4 * 1031 * edge;
      p[1] += 4 * edge;
    }
    if (vast == 0 && below(20) == 0) p[2] += 4 * 300 * edge;
    cloud.points.push_back({static_cast<float>(p[0] + off), static_cast<float>(p[1]), static_cast<float>(p[2] - off)});
    if (below(50) == 0) cloud.points.back().y = std::numeric_limits<float>::quiet_NaN();
    if (below(200) == 0) cloud.points.back().x = 3e38f;
    if (coloured)
      cloud.colours.push_back(
          {static_cast<uint8_t>(below(256)), static_cast<uint8_t>(below(256)), static_cast<uint8_t>(below(256))});
  }
  return cloud;
}

/// Every bit of a cloud, whatever its order.
auto bits(const CloudView& cloud) {
  std::vector<std::tuple<uint32_t, uint32_t, uint32_t, int, int, int>> all;
  for (size_t i = 0; i < cloud.points.size(); ++i) {
    const Point& p = cloud.points[i];
    const Colour& c = cloud.colours[i];
    all.emplace_back(std::bit_cast<uint32_t>(p.x), std::bit_cast<uint32_t>(p.y), std::bit_cast<uint32_t>(p.z), c.b, c.g,
                     c.r);
  }
  std::sort(all.begin(), all.end());
  return all;
}

}  // namespace

TEST_CASE("reduction, smoothing and interpolation give the points of their references, bit for bit") {
  std::mt19937 random(takt::test::seed(1));
  VoxelGrid grid(kMost);  // one object for all rounds: nothing may be left over from a round
  Cloud memory{std::vector<Point>(100 * kMost), std::vector<Colour>(100 * kMost)};
  size_t made = 0;
  for (int round = 0; round < takt::test::rounds(300); ++round) {
    CAPTURE(round);
    const double edge = std::uniform_real_distribution<>(0.01, 0.5)(random);
    const Cloud cloud = random_cloud(random, edge);
    const auto check = [&](const auto& operation, const Cloud& reference) {
      CloudBuffer out(memory.points, memory.colours);
      grid.fill(cloud.view(), edge);
      operation(out);
      REQUIRE(out.lost() == 0);
      CHECK(bits(out.view()) == bits(reference.view()));
      return out.size();
    };
    const size_t reduced = check([&](CloudBuffer& out) { reduce(grid, out); }, reduce_reference(cloud.view(), edge));
    const SmoothParameters s{edge, std::uniform_int_distribution<>(0, 12)(random) / 40.0};
    check([&](CloudBuffer& out) { smooth(grid, s.t_occ, out); }, smooth_reference(cloud.view(), s));
    const InterpolateParameters p{edge, std::uniform_int_distribution<>(1, 9)(random),
                                  std::uniform_int_distribution<>(1, 8)(random),
                                  std::uniform_int_distribution<>(2, 16)(random) / 4.0};
    made +=
        check([&](CloudBuffer& out) { interpolate(grid, p, out); }, interpolate_reference(cloud.view(), p)) - reduced;
  }
  CHECK(made >= takt::test::at_scale(1000));
}

TEST_CASE("the order of voxels does not depend on that of the points") {
  std::mt19937 random(takt::test::seed(4));
  VoxelGrid grid(kMost);
  const auto voxels = [&](const Cloud& cloud, double edge) {
    grid.fill(cloud.view(), edge);
    std::vector<std::tuple<uint32_t, uint32_t, uint32_t, uint32_t>> all;
    for (const Voxel& v : grid.voxels()) all.emplace_back(v.points, v.b, v.g, v.r);
    return all;
  };
  for (int round = 0; round < takt::test::rounds(100); ++round) {
    Cloud cloud = random_cloud(random, 0.1), shuffled;
    cloud.colours.resize(cloud.points.size());
    std::vector<size_t> order(cloud.points.size());
    std::iota(order.begin(), order.end(), size_t{0});
    std::shuffle(order.begin(), order.end(), random);
    for (const size_t i : order) {
      shuffled.points.push_back(cloud.points[i]);
      shuffled.colours.push_back(cloud.colours[i]);
    }
    CHECK(voxels(cloud, 0.1) == voxels(shuffled, 0.1));
  }
}

TEST_CASE("the same cloud gives the same bytes in the same order, whatever was filtered before") {
  std::mt19937 random(takt::test::seed(2));
  FilterSteps steps;
  steps.outliers = {0.3, 3};
  steps.interpolate.edge_m = 0.1;
  steps.smooth.edge_m = 0.1;
  steps.reduce_edge_m = 0.15;
  constexpr size_t kCapacity = 20 * kMost;
  CloudFilter used(kCapacity, steps);
  const auto run = [&](CloudFilter& filter, const Cloud& cloud) {
    Cloud memory{std::vector<Point>(kCapacity), std::vector<Colour>(kCapacity)};
    CloudBuffer out(memory.points, memory.colours);
    for (size_t i = 0; i < cloud.points.size(); ++i)
      out.push(cloud.points[i], cloud.colours.empty() ? Colour{} : cloud.colours[i]);
    std::vector<Step> done;
    filter.run(out, [&](const StepResult& result) { done.push_back(result.step); });
    CHECK(done == std::vector{Step::outliers, Step::interpolate, Step::smooth, Step::reduce});
    CHECK(out.lost() == 0);
    memory.points.resize(out.size());
    memory.colours.resize(out.size());
    return memory;
  };
  size_t points = 0;
  for (int round = 0; round < takt::test::rounds(40); ++round) {
    const Cloud cloud = random_cloud(random, 0.1);
    CloudFilter fresh(kCapacity, steps);
    const Cloud a = run(used, cloud), b = run(fresh, cloud);
    points += a.points.size();
    const auto same = [](const auto& x, const auto& y) {
      return x.size() == y.size() && std::equal(x.begin(), x.end(), y.begin(), [](const auto& p, const auto& q) {
               return std::memcmp(&p, &q, sizeof p) == 0;
             });
    };
    CHECK(same(a.points, b.points));
    CHECK(same(a.colours, b.colours));
  }
  CHECK(points >= takt::test::at_scale(1000));
}
