// SPDX-License-Identifier: Apache-2.0
// Median fusion and the map against their plain definitions.
#include <doctest/doctest.h>

#include <algorithm>
#include <map>
#include <random>
#include <vector>

#include "nodes/mapping_3d/generated_world.hpp"
#include "nodes/mapping_3d/median_fusion.hpp"
#include "nodes/mapping_3d/tile_map.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/point.hpp"
#include "rt/transform/pose_math.hpp"
#include "tests/on_each_target.hpp"
#include "tests/property_scale.hpp"

using namespace takt;
using namespace takt::mapping_3d;

namespace {

/// Views of a room from anywhere near, and of noise.
struct Views {
  std::vector<std::vector<float>> depth_m;
  std::vector<DepthView> views;

  Views(size_t count, Lot& lot, uint64_t seed) : depth_m(count) {
    WorldCamera c;
    c.width = 20 + static_cast<int>(lot.in(0, 50));
    c.height = 15 + static_cast<int>(lot.in(0, 20));
    c.step_px = 16;
    const World world = furnished_room(seed);
    const double x = lot.in(1.5, 2.2), y = lot.in(-1, 1), heading = lot.in(-3, 3);
    for (size_t k = 0; k < count; ++k) {
      const Look seen =
          look(world, c, robot_at(x + lot.in(-0.3, 0.3), y + lot.in(-0.3, 0.3), heading + lot.in(-0.4, 0.4)), lot);
      const DepthCamera camera =
          depth_camera_of(c.model(), c.step_px, static_cast<size_t>(c.width) * static_cast<size_t>(c.height));
      depth_m[k].resize(camera.pixels());
      DepthView view{camera, disturbed(seen.camera_in_world, 0.02, 0.01, lot), depth_m[k], {}};
      draw(seen.points, {}, view);
      for (float& depth : depth_m[k])
        if (lot.chance(0.1)) depth = lot.chance(0.5) ? 0 : static_cast<float>(lot.in(0.5, 8));
      views.push_back(view);
    }
  }
};

}  // namespace

TEST_CASE("median fusion equals the algorithm pixel by pixel, view by view, on every target") {
  test::on_each_target([] {
    size_t contested = 0, known = 0;
    for (uint64_t round = 0; round < test::rounds(30u); ++round) {
      CAPTURE(round);
      Lot lot(test::seed(5), round);
      const size_t count = 1 + static_cast<size_t>(lot.in(0, 11.999));
      Views views(count, lot, test::seed(round));
      const auto reference = static_cast<size_t>(lot.in(0, static_cast<double>(count) - 0.001));
      FusionParameters p;
      p.steps = lot.chance(0.3) ? 0 : lot.in(0, 2);
      p.least_m = lot.chance(0.3) ? 0 : 0.01;
      p.refine = lot.chance(0.7);
      p.support = 1 + static_cast<int>(lot.in(0, 3));
      const size_t pixels = views.views[0].camera.pixels();
      std::vector<float> fast(pixels), plain(pixels);
      MedianFusion fusion(count, pixels);
      fusion.fuse(views.views, reference, p, fast);
      MedianFusion::fuse_reference(views.views, reference, p, plain);
      CHECK(fast == plain);
      for (size_t i = 0; i < pixels; ++i) {
        known += fast[i] > 0;
        contested += fast[i] > 0 && std::abs(fast[i] - views.depth_m[reference][i]) > 0.2;
      }
    }
    CHECK(known >= test::at_scale(5000));
    CHECK(contested >= test::at_scale(500));
  });
}

TEST_CASE("the map holds the voxels that were seen, each once, with the mean of what was seen there, in any tiles") {
  for (uint64_t round = 0; round < test::rounds(20u); ++round) {
    CAPTURE(round);
    Lot lot(test::seed(6), round);
    MapParameters p;
    p.voxel_m = lot.in(0.04, 0.3);
    p.tile_m = lot.in(0.5, 3);
    p.tiles = 64;
    p.tile_points = 4096;
    TileMap map(p);
    const cloud::VoxelSize size(p.voxel_m);
    std::map<cloud::VoxelIndex, int> seen;
    for (int step = 0; step < 12; ++step) {
      const Transform sensor = robot_at(lot.in(-6, 6), lot.in(-6, 6), lot.in(-3, 3));
      const Affine to_map = to_affine(sensor);
      std::vector<Point> points;
      for (int i = 0; i < 300; ++i) {
        points.push_back(
            {static_cast<float>(lot.in(-2, 2)), static_cast<float>(lot.in(-2, 2)), static_cast<float>(lot.in(0, 1))});
        const Position at = transformed(to_map, points.back().x, points.back().y, points.back().z);
        const auto clear_of_border = [&](double v) {
          const double share = v / p.voxel_m - std::floor(v / p.voxel_m);
          return share > 1e-3 && share < 1 - 1e-3;  // rounding may put a point at a border into either
        };
        if (clear_of_border(at.x_m) && clear_of_border(at.y_m) && clear_of_border(at.z_m))
          ++seen[size.voxel_of({static_cast<float>(at.x_m), static_cast<float>(at.y_m), static_cast<float>(at.z_m)})];
        else points.pop_back();
      }
      map.add({points, {}}, sensor, step);
    }
    std::map<cloud::VoxelIndex, int> kept;
    bool counts_agree = true;
    map.for_each([&](const Position& at, const MapPoint& point) {
      const auto voxel =
          size.voxel_of({static_cast<float>(at.x_m), static_cast<float>(at.y_m), static_cast<float>(at.z_m)});
      ++kept[voxel];
      counts_agree &= seen.contains(voxel) && point.seen == std::min<int>(Tile::kMostSeen, seen[voxel]);
    });
    CHECK(counts_agree);
    CHECK(kept.size() == seen.size());
    CHECK(std::all_of(kept.begin(), kept.end(), [](const auto& entry) { return entry.second == 1; }));
    CHECK(map.points() == seen.size());
    CHECK(map.tiles() > 1);
  }
}
