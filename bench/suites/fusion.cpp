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
#include "rt/msg/geometry.hpp"
#include "rt/msg/point.hpp"

namespace takt::bench {

std::vector<Row> run_fusion(const Options& options);

namespace {

using namespace mapping_3d;

constexpr double kStep_m = 0.15, kCircle_m = 1.9;
constexpr size_t kLooks = 80;  // more than a round

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

WorldCamera camera_of(int width, int step_px, double focal_px) {
  WorldCamera camera;
  camera.width = width;
  camera.height = width * 3 / 4;
  camera.step_px = step_px;
  camera.focal_px = focal_px;
  return camera;
}

/// A walk whose clouds go into a map of about so many other points: all that add_view() and tidy() do with one, and
/// each of tidy()'s portions.
struct CloudRows {
  Row cloud, portion;
};
CloudRows cloud_rows(const std::string& name, const WorldCamera& camera, size_t looks, size_t views, size_t map_points,
                     int rounds) {
  const std::vector<Look> seen = walk(camera, looks);
  const DepthCamera pixels = pixels_of(camera);
  CloudRows out{row("cloud/" + name), row("tidy/" + name)};
  for (int pass = 0; pass < std::max(1, rounds / 5); ++pass) {
    MapperParameters p;
    p.views = views;
    p.map.tiles = 64;
    CloudMapper mapper(p, pixels.pixels());
    fill(mapper, map_points);
    int64_t stamp_ns = 0;
    for (const Look& look : seen) {
      const int64_t begin_ns = thread_cpu_ns();
      mapper.add_view(look.cloud(), pixels, look.camera_in_world, ++stamp_ns);
      int64_t asked_ns = 0;
      const auto portion_ends = [&] {
        const int64_t now_ns = thread_cpu_ns();
        if (asked_ns > 0) out.portion.samples.add(static_cast<double>(now_ns - asked_ns) * 1e-6);
        asked_ns = now_ns;
        return true;
      };
      mapper.tidy(portion_ends);
      portion_ends();
      out.cloud.samples.add(static_cast<double>(asked_ns - begin_ns) * 1e-6);
    }
  }
  for (Row* r : {&out.cloud, &out.portion}) r->value = r->samples.quantile(0.5).value_or(0);
  return out;
}

}  // namespace

std::vector<Row> run_fusion(const Options& options) {
  const int rounds = options.rounds_or(10);
  const auto several = static_cast<size_t>(rounds);
  std::vector<Row> rows;
  for (const size_t views : {5, 9}) fuse_rows(rows, WorldCamera{}, views, several);
  for (const size_t views : {5, 9}) fuse_rows(rows, camera_of(640, 1, 492.8), views, std::max<size_t>(1, several / 3));
  fuse_rows(rows, camera_of(1280, 1, 985.6), 5, std::max<size_t>(1, several / 5));
  const auto add = [&](const std::string& name, const WorldCamera& camera, size_t looks, size_t views, size_t points) {
    CloudRows measured = cloud_rows(name, camera, looks, views, points, rounds);
    rows.push_back(std::move(measured.cloud));
    if (points > 0) rows.push_back(std::move(measured.portion));
  };
  for (const size_t views : {1, 5, 9, 16}) add(fmt::format("window_{}", views), {}, kLooks, views, 0);
  for (const size_t points : {100'000, 400'000}) add(fmt::format("map_{}", points), {}, kLooks, 5, points);
  // What stereo gives in `ace`, in `fine` and in the original; fewer looks, which take their time to be rendered.
  add("points_76800", camera_of(320, 2, 492.8), kLooks / 2, 5, 0);
  add("points_307200", camera_of(640, 2, 985.6), kLooks / 4, 5, 0);
  add("points_1228800", camera_of(1280, 1, 985.6), kLooks / 4, 5, 0);
  return rows;
}

}  // namespace takt::bench
