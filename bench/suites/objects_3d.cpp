// SPDX-License-Identifier: Apache-2.0
// Things on a table to objects, one thread, CPU time: growing all regions of generated scenes of three things, against
// thesis Alg. 3.2 as it is printed (a queue and a radius search in nanoflann's kd-tree for each point, the tree built
// for each cloud) and against the plain definition (every point against every other); and the whole of it, from a cloud
// of 76,800 points to objects with classes.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "bench/interleaved.hpp"
#include "bench/kd_tree.hpp"
#include "bench/suite.hpp"
#include "graph/cli/outcome.hpp"
#include "nodes/object_3d/evaluate.hpp"
#include "rt/msg/point.hpp"

namespace takt::bench {

std::vector<Row> run_objects_3d(const Options& options);

namespace {

using namespace object_3d;

constexpr size_t kScenes = 6, kMostObjects = 32;

struct Things {
  std::vector<Point> points;  ///< of all things of a scene, z up
  std::vector<uint32_t> seeds;
};

Things things_of(const Scene& scene) {
  Things things;
  const mapping_3d::Affine mount = mapping_3d::to_affine(scene.sensor_in_robot);
  for (size_t i = 0; i < scene.points.size(); ++i) {
    if (scene.object[i] < 0) continue;
    const Point& p = scene.points[i];
    const mapping_3d::Position at =
        mapping_3d::transformed(mount, static_cast<double>(p.x), static_cast<double>(p.y), static_cast<double>(p.z));
    things.seeds.push_back(static_cast<uint32_t>(things.points.size()));
    things.points.push_back({static_cast<float>(at.x_m), static_cast<float>(at.y_m), static_cast<float>(at.z_m)});
  }
  return things;
}

/// Regions of so many points at least that their reach does not cut; a point is in one region at most.
size_t regions_by_kd_tree(const Things& things, const SegmentParameters& p) {
  const std::vector<Point>& points = things.points;
  const KdTreePoints all{points};
  KdTree tree(3, all, nanoflann::KDTreeSingleIndexAdaptorParams(10));
  tree.buildIndex();
  std::vector<uint32_t> seeds = things.seeds;
  std::sort(seeds.begin(), seeds.end(), [&](uint32_t a, uint32_t b) { return points[a].z > points[b].z; });
  std::vector<bool> visited(points.size());
  std::vector<std::pair<uint32_t, float>> near;
  const float radius2 = std::nextafter(p.grow.d_max_m * p.grow.d_max_m, 1.0f);
  size_t regions = 0;
  for (const uint32_t seed : seeds) {
    if (visited[seed]) continue;
    std::vector<uint32_t> region{seed};
    visited[seed] = true;
    bool cut = false;
    for (size_t i = 0; i < region.size(); ++i) {
      tree.radiusSearch(&points[region[i]].x, radius2, near, nanoflann::SearchParams(32, 0, false));
      for (const auto& [k, distance2] : near) {
        if (visited[k]) continue;
        const bool within = p.reach.holds(points[seed], points[k].x, points[k].y, points[k].z);
        cut |= !within;
        if (!within) continue;
        visited[k] = true;
        region.push_back(k);
      }
    }
    regions += !cut && region.size() >= p.points_min;
  }
  return regions;
}

}  // namespace

std::vector<Row> run_objects_3d(const Options& options) {
  const Training training = read_training(command::shipped("graph/objects_3d.txt"));
  const auto classifier = make_classifier(Method::nearest, training);
  std::vector<Scene> scenes;
  std::vector<Things> things;
  size_t points = 0, most = 0;
  for (uint64_t i = 0; i < kScenes; ++i) {
    scenes.push_back(make_scene(table_models(), {i % 6, (i + 2) % 6, (i + 4) % 6}, {}, 11, i));
    things.push_back(things_of(scenes.back()));
    points += things.back().points.size();
    most = std::max(most, scenes.back().points.size());
  }
  const SegmentParameters p;
  Segmenter segmenter(most, kMostObjects);
  std::vector<uint32_t> seeds;
  const auto segments = [&](const Things& of) {
    seeds = of.seeds;
    segmenter.begin(of.points, {}, seeds, p);
    while (segmenter.advance()) {
    }
  };
  for (const Things& of : things) {
    segments(of);
    if (const size_t wanted = regions_by_kd_tree(of, p); segmenter.segments().size() != wanted)
      throw std::runtime_error("objects_3d: " + std::to_string(segmenter.segments().size()) +
                               " regions, the kd-tree's " + std::to_string(wanted));
  }
  std::vector<Row> rows;
  const auto a_scene = [&](auto work) {  // mean over all scenes, so that rounds are alike
    return cpu_ms([&] {
             for (const Things& of : things) work(of);
           }) /
           kScenes;
  };
  const auto add = [&](const std::string& name, const std::string& reference, int rounds, auto other) {
    std::fprintf(stderr, "objects_3d: %s, %zu points a scene\n", name.c_str(), points / kScenes);
    Compared figures = compare(
        static_cast<size_t>(rounds), [&] { return a_scene(other); }, [&] { return a_scene(segments); });
    Row row{"objects_3d/" + name, "ms", 0, std::move(figures.changed), {}, {}, {}, "one thread"};
    add_pair(rows, std::move(row), reference, figures.pairs);
  };
  add("regions", "Alg. 3.2 over a kd-tree", options.rounds_or(60),
      [&](const Things& of) { regions_by_kd_tree(of, p); });
  add("regions_again", "every point against every other", options.rounds_or(12),
      [&](const Things& of) { segment_reference(of.points, {}, of.seeds, p); });
  ObjectFinder finder(most, kMostObjects, {}, classifier.get());
  Row whole{"objects_3d/cloud_to_classes", "ms", 0, {}, {}, {}, {}, "one thread"};
  for (int round = 0; round < options.rounds_or(60); ++round)
    whole.samples.add(
        cpu_ms([&] { finder.run(scenes[static_cast<size_t>(round) % kScenes].cloud(), {}, [] { return true; }); }));
  whole.value = whole.samples.quantile(0.5).value_or(0);
  rows.push_back(std::move(whole));
  return rows;
}

}  // namespace takt::bench
