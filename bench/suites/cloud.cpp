// SPDX-License-Identifier: Apache-2.0
// Operations on point clouds, one thread, CPU time: outlier removal against a kd-tree (nanoflann: build, then a radius
// search for each point that stops at n_min), the others against their slow versions, which keep voxels in a
// std::unordered_map. The cloud is made here: the walls of a hall of 24 x 20 x 8 m, 5 mm of noise, and 2 % of points
// that fly anywhere; 91 others within 0.2 m in the mean for 1.2 million points.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <tuple>

#include "bench/interleaved.hpp"
#include "bench/kd_tree.hpp"
#include "bench/suite.hpp"
#include "nodes/cloud/outlier_filter.hpp"
#include "nodes/cloud/voxel_reference.hpp"
#include "rt/msg/point.hpp"

namespace takt::bench {

std::vector<Row> run_cloud(const Options& options);

namespace {

constexpr double kRadius_m = 0.2;
constexpr double kSize_m[3] = {24, 20, 8};

/// `scanned`: wall by wall, line by line, as a sensor brings it; else in random order, at which caches help nobody.
std::vector<Point> hall(size_t points, bool scanned) {
  struct Seen {
    int wall;
    int line;
    Point point;
  };
  std::mt19937 random(1);
  const auto uniform = [&](double high) { return std::uniform_real_distribution<>(0, high)(random); };
  std::normal_distribution<> noise(0, 0.005);
  const double area[3] = {kSize_m[1] * kSize_m[2], kSize_m[0] * kSize_m[2], kSize_m[0] * kSize_m[1]};
  std::discrete_distribution<> axes({area[0], area[1], area[2]});
  std::vector<Seen> seen(points);
  for (Seen& s : seen) {
    double p[3] = {uniform(kSize_m[0]), uniform(kSize_m[1]), uniform(kSize_m[2])};
    const int axis = axes(random);
    const bool far_wall = uniform(1) < 0.5;
    if (uniform(1) >= 0.02) p[axis] = (far_wall ? kSize_m[axis] : 0) + noise(random);
    s = {2 * axis + far_wall,
         static_cast<int>(p[axis == 2 ? 1 : 2] / 0.04),
         {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])}};
  }
  if (scanned)
    std::sort(seen.begin(), seen.end(), [](const Seen& a, const Seen& b) {
      return std::tuple(a.wall, a.line, a.point.x, a.point.y) < std::tuple(b.wall, b.line, b.point.x, b.point.y);
    });
  std::vector<Point> cloud;
  for (const Seen& s : seen) cloud.push_back(s.point);
  return cloud;
}

struct Coloured {
  std::vector<Point> points;
  std::vector<Colour> colours;
  explicit Coloured(size_t count) : points(hall(count, true)), colours(count) {
    std::mt19937 random(2);
    for (Colour& c : colours)
      c = {static_cast<uint8_t>(random()), static_cast<uint8_t>(random()), static_cast<uint8_t>(random())};
  }
  cloud::CloudView view() const { return {points, colours}; }
};

/// For nanoflann: counts, and ends the search at `enough`. It takes what is nearer than worstDist().
struct Counter {
  using DistanceType = float;
  float radius2;
  size_t enough, count = 0;
  size_t size() const { return count; }
  bool full() const { return true; }
  bool addPoint(float, uint32_t) { return ++count < enough; }
  float worstDist() const { return std::nextafter(radius2, 1.0f); }
};

void filter_with_kd_tree(const std::vector<Point>& cloud, int n_min, std::span<uint8_t> keep) {
  const KdTreePoints points{cloud};
  KdTree tree(3, points, nanoflann::KDTreeSingleIndexAdaptorParams(10));
  tree.buildIndex();
  const auto radius = static_cast<float>(kRadius_m);
  for (size_t i = 0; i < cloud.size(); ++i) {
    Counter counter{radius * radius, static_cast<size_t>(n_min) + 1};  // it finds the point itself, too
    tree.findNeighbors(counter, &cloud[i].x, nanoflann::SearchParams());
    keep[i] = counter.count >= counter.enough;
  }
}

void add(std::vector<Row>& rows, const std::string& name, const std::string& reference, const Compared& compared) {
  Row row{"cloud/" + name, "ms", 0, {}, {}, {}, {}, std::string("one thread, ") + cloud::simd_target()};
  row.samples = compared.changed;
  add_pair(rows, std::move(row), reference, compared.pairs);
}

std::string thousands(size_t points) { return std::to_string(points / 1000) + "k"; }

void measure_outliers(std::vector<Row>& rows, const std::vector<Point>& points, const std::string& order, int n_min,
                      int rounds) {
  const std::string name = "outliers/" + thousands(points.size()) + "_n" + std::to_string(n_min) + "_" + order;
  std::fprintf(stderr, "cloud: %s, %d rounds\n", name.c_str(), rounds);
  cloud::OutlierFilter filter(points.size());
  std::vector<uint8_t> ours(points.size()), theirs(points.size());
  const Compared compared = compare(
      static_cast<size_t>(rounds), [&] { return cpu_ms([&] { filter_with_kd_tree(points, n_min, theirs); }); },
      [&] { return cpu_ms([&] {
              filter.filter(points, {kRadius_m, n_min}, ours);
            }); });
  if (ours != theirs) throw std::runtime_error(name + ": the filter and nanoflann decide differently");
  add(rows, name, "nanoflann", compared);
}

/// The points of both, in one order.
bool same(const cloud::CloudView& a, const cloud::CloudView& b) {
  const auto sorted = [](const cloud::CloudView& cloud) {
    std::vector<std::tuple<float, float, float, uint8_t, uint8_t, uint8_t>> all;
    for (size_t i = 0; i < cloud.points.size(); ++i) {
      const Point& p = cloud.points[i];
      const Colour& c = cloud.colours[i];
      all.emplace_back(p.x, p.y, p.z, c.b, c.g, c.r);
    }
    std::sort(all.begin(), all.end());
    return all;
  };
  return sorted(a) == sorted(b);
}

/// `ours` fills a buffer with the grid, `theirs` makes a cloud.
template <class Ours, class Theirs>
void measure_voxels(std::vector<Row>& rows, const std::string& what, const cloud::CloudView& cloud, int rounds,
                    const Ours& ours, const Theirs& theirs) {
  const std::string name = what + "/" + thousands(cloud.points.size()) + "_scan";
  std::fprintf(stderr, "cloud: %s, %d rounds\n", name.c_str(), rounds);
  cloud::VoxelGrid grid(cloud.points.size());
  std::vector<Point> points(4 * cloud.points.size());
  std::vector<Colour> colours(points.size());
  cloud::CloudBuffer result(points, colours);
  cloud::Cloud reference;
  const Compared compared = compare(
      static_cast<size_t>(rounds), [&] { return cpu_ms([&] { reference = theirs(); }); },
      [&] {
        result.clear();
        return cpu_ms([&] { ours(grid, result); });
      });
  if (!same(result.view(), reference.view())) throw std::runtime_error(name + ": not the points of the slow version");
  add(rows, name, "unordered_map", compared);
}

}  // namespace

std::vector<Row> run_cloud(const Options& options) {
  const int rounds = options.rounds_or(20), of_slow = options.rounds_or(5), of_slowest = options.rounds_or(3);
  std::vector<Row> rows;
  for (const size_t points : {300'000, 1'200'000}) {
    const auto scanned = hall(points, true);
    for (const int n_min : {10, 20, 100}) measure_outliers(rows, scanned, "scan", n_min, rounds);
    measure_outliers(rows, hall(points, false), "random", points == 300'000 ? 10 : 20, of_slow);
  }
  const Coloured large(300'000), small(100'000);
  const double edge_m = 0.1;
  measure_voxels(
      rows, "reduce", large.view(), rounds,
      [&](cloud::VoxelGrid& grid, cloud::CloudBuffer& out) {
        grid.fill(large.view(), edge_m);
        cloud::reduce(grid, out);
      },
      [&] { return cloud::reduce_reference(large.view(), edge_m); });
  const cloud::SmoothParameters smooth{.edge_m = edge_m};
  measure_voxels(
      rows, "smooth", small.view(), of_slowest,
      [&](cloud::VoxelGrid& grid, cloud::CloudBuffer& out) {
        grid.fill(small.view(), edge_m);
        cloud::smooth(grid, smooth.t_occ, out);
      },
      [&] { return cloud::smooth_reference(small.view(), smooth); });
  const cloud::InterpolateParameters interpolate{.edge_m = edge_m};
  measure_voxels(
      rows, "interpolate", small.view(), of_slowest,
      [&](cloud::VoxelGrid& grid, cloud::CloudBuffer& out) {
        grid.fill(small.view(), edge_m);
        cloud::interpolate(grid, interpolate, out);
      },
      [&] { return cloud::interpolate_reference(small.view(), interpolate); });
  return rows;
}

}  // namespace takt::bench
