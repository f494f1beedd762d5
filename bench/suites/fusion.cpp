// SPDX-License-Identifier: Apache-2.0
// Median fusion of views of a generated room: against the algorithm pixel by pixel and view by view, with equal
// results, for sizes of image and window; and a cloud on its way into maps of different sizes.
#include <fmt/format.h>

#include <cstdio>
#include <stdexcept>

#include "bench/interleaved.hpp"
#include "bench/suite.hpp"
#include "nodes/mapping_3d/cloud_mapper.hpp"
#include "nodes/mapping_3d/generated_world.hpp"

namespace takt::bench {

std::vector<Row> run_fusion(const Options& options);

namespace {

using namespace mapping_3d;

constexpr double kStep_m = 0.15, kCircle_m = 1.9;

DepthCamera pixels_of(const WorldCamera& c) {
  return depth_camera_of(c.model(), c.step_px, static_cast<size_t>(c.width) * static_cast<size_t>(c.height));
}

std::vector<Look> walk(const WorldCamera& camera, size_t looks) {
  const World world = furnished_room(1);
  Lot lot(1, 0);
  std::vector<Look> out;
  for (size_t i = 0; i < looks; ++i) {
    const double at = static_cast<double>(i) * kStep_m / kCircle_m;
    out.push_back(look(world, camera, robot_at(kCircle_m * std::cos(at), kCircle_m * std::sin(at), at), lot));
  }
  return out;
}

Row row(const std::string& name) {
  std::fprintf(stderr, "fusion: %s\n", name.c_str());
  return {"fusion/" + name, "ms", 0, {}, {}, {}, {}, "one thread, CPU time"};
}

void fuse_rows(std::vector<Row>& rows, const WorldCamera& camera, size_t count, size_t rounds) {
  const std::vector<Look> looks = walk(camera, count);
  const DepthCamera pixels = pixels_of(camera);
  std::vector<std::vector<float>> depth_m(count, std::vector<float>(pixels.pixels()));
  std::vector<DepthView> views;
  for (size_t k = 0; k < count; ++k) {
    views.push_back({pixels, looks[k].camera_in_world, depth_m[k], {}});
    draw(looks[k].points, {}, views[k]);
  }
  MedianFusion fusion(count, pixels.pixels());
  std::vector<float> ours(pixels.pixels()), theirs(pixels.pixels());
  const auto fast = [&] { return cpu_ms([&] { fusion.fuse(views, count / 2, {}, ours); }); };
  const auto plain = [&] { return cpu_ms([&] { MedianFusion::fuse_reference(views, count / 2, {}, theirs); }); };
  Row figures = row(fmt::format("median/{}x{}/{}", camera.width, camera.height, count));
  Compared compared = compare(rounds, plain, fast);
  if (ours != theirs) throw std::runtime_error("fusion: the fast result is not that of the reference");
  figures.samples = std::move(compared.changed);
  add_pair(rows, std::move(figures), "pixel by pixel", compared.pairs);
}

/// A map of about so many points: tiles far apart, each with a plane, and those of the room.
void fill(CloudMapper& mapper, size_t points) {
  std::vector<Point> plane;
  for (int i = 0; i < 100; ++i)
    for (int k = 0; k < 100; ++k)
      plane.push_back({0.05f * static_cast<float>(i), 0.05f * static_cast<float>(k), 0.02f});
  for (size_t tile = 0; tile * plane.size() < points; ++tile) {
    Transform place;
    place.x = 3.5 * static_cast<double>(tile % 6) - 9;
    place.y = 3.5 * static_cast<double>(tile / 6) - 9;
    place.z = 0.05 * static_cast<double>(tile);  // so that no plane lies in another
    mapper.add_sweep({plane, {}}, place, 1);
  }
}

Row cloud_row(const std::string& name, size_t views, size_t map_points, int rounds) {
  const WorldCamera camera;
  const std::vector<Look> looks = walk(camera, 80);
  Row out = row(name);
  for (int pass = 0; pass < std::max(1, rounds / 5); ++pass) {
    MapperParameters p;
    p.views = views;
    p.map.tiles = 64;
    CloudMapper mapper(p, pixels_of(camera).pixels());
    fill(mapper, map_points);
    int64_t stamp_ns = 0;
    for (const Look& look : looks)
      out.samples.add(
          cpu_ms([&] { mapper.add_view(look.cloud(), pixels_of(camera), look.camera_in_world, ++stamp_ns); }));
  }
  out.value = out.samples.quantile(0.5).value_or(0);
  return out;
}

WorldCamera camera_of(int width, int step_px, double focal_px) {
  WorldCamera camera;
  camera.width = width;
  camera.height = width * 3 / 4;
  camera.step_px = step_px;
  camera.focal_px = focal_px;
  return camera;
}

}  // namespace

std::vector<Row> run_fusion(const Options& options) {
  const int rounds = options.rounds_or(10);
  const auto several = static_cast<size_t>(rounds);
  std::vector<Row> rows;
  for (const size_t views : {5, 9}) fuse_rows(rows, WorldCamera{}, views, several);
  for (const size_t views : {5, 9}) fuse_rows(rows, camera_of(640, 1, 492.8), views, std::max<size_t>(1, several / 3));
  fuse_rows(rows, camera_of(1280, 1, 985.6), 5, std::max<size_t>(1, several / 5));
  for (const size_t views : {1, 5, 9, 16})
    rows.push_back(cloud_row(fmt::format("cloud/window_{}", views), views, 0, rounds));
  for (const size_t points : {100'000, 400'000})
    rows.push_back(cloud_row(fmt::format("cloud/map_{}", points), 5, points, rounds));
  return rows;
}

}  // namespace takt::bench
