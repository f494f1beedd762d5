// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <set>

#include "nodes/mapping_3d/evaluate.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/point.hpp"
#include "rt/quantile.hpp"
#include "rt/time/clock.hpp"
#include "rt/transform/pose_math.hpp"

namespace takt::mapping_3d {
namespace {

using Eigen::Vector3d;

constexpr int64_t kPeriodNs = 500'000'000;  // the rate of the node: 2 Hz
constexpr double kCircle_m = 1.9, kStep_m = 0.15;

DepthCamera depth_camera_of(const WorldCamera& c) {
  return mapping_3d::depth_camera_of(c.model(), c.step_px,
                                     static_cast<size_t>(c.width) * static_cast<size_t>(c.height));
}

Transform on_circle(size_t step) {
  const double at = static_cast<double>(step) * kStep_m / kCircle_m;
  return robot_at(kCircle_m * std::cos(at), kCircle_m * std::sin(at), at);
}

/// A mapper and what its clouds cost.
class Mapped {
 public:
  explicit Mapped(const MapperParameters& p) : mapper(p, depth_camera_of(WorldCamera{}).pixels()) {}

  void add(const Look& look, const Transform& camera_in_map) {
    const DepthCamera camera = depth_camera_of(WorldCamera{});
    const int64_t begin = thread_cpu_ns();
    mapper.add_view(look.cloud(), camera, camera_in_map, ++clouds * kPeriodNs);
    mapper.tidy();
    times_ms.push_back(static_cast<double>(thread_cpu_ns() - begin) * 1e-6);
  }
  /// Of the map's points from the world's surfaces.
  double rms_m(const World& world) const {
    double squares = 0;
    size_t count = 0;
    mapper.map().for_each([&](const Position& at, const MapPoint&) {
      const double off = distance_m(world, {at.x_m, at.y_m, at.z_m});
      squares += off * off;
      ++count;
    });
    return std::sqrt(squares / std::max<double>(1, static_cast<double>(count)));
  }

  CloudMapper mapper;
  int64_t clouds = 0;
  std::vector<double> times_ms;
};

cloud::VoxelIndex beside(const cloud::VoxelIndex& v, int i) {
  return {v.x + i % 3 - 1, v.y + i / 3 % 3 - 1, v.z + i / 9 - 1};
}

using Voxels = std::map<cloud::VoxelIndex, int>;  ///< and how often each was met

cloud::VoxelIndex voxel_of(const cloud::VoxelSize& size, const Position& at) {
  return size.voxel_of({static_cast<float>(at.x_m), static_cast<float>(at.y_m), static_cast<float>(at.z_m)});
}

/// `surfaces`: voxels of the true ones, and how many looks met each.
MapFigures figures_of(const Mapped& mapped, const World& world, const Voxels& surfaces, const cloud::VoxelSize& size,
                      size_t seen_points) {
  Voxels held;
  mapped.mapper.map().for_each([&](const Position& at, const MapPoint&) { ++held[voxel_of(size, at)]; });
  size_t twice = 0, near = 0, exact = 0;
  for (const auto& [voxel, looks] : surfaces) {
    if (looks < 2) continue;
    ++twice;
    exact += held.contains(voxel);
    for (int i = 0; i < 27; ++i)
      if (held.contains(beside(voxel, i))) {
        ++near;
        break;
      }
  }
  MapFigures out;
  const auto share = [](size_t part, size_t all) {
    return static_cast<double>(part) / std::max<double>(1, static_cast<double>(all));
  };
  out.points = mapped.mapper.map().points();
  out.factor = share(seen_points, out.points);
  out.points_a_voxel = share(out.points, held.size());
  out.completeness_pct = 100 * share(near, twice);
  out.exact_pct = 100 * share(exact, twice);
  out.rms_m = mapped.rms_m(world);
  return out;
}

/// Every point that is seen is kept, one a voxel.
MapperParameters plain_merge(MapperParameters p) {
  p.views = 1;
  p.fusion.support = 1;
  p.clear = false;
  return p;
}

double resident_mb() {
  std::ifstream statm("/proc/self/statm");
  double total = 0, resident = 0;
  statm >> total >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) * 1e-6;
}

Transform camera_in(const Transform& robot_in_map, const Look& look, const Transform& robot_in_world) {
  const UncertainPose mount = compose(inverse({robot_in_world, {}}), {look.camera_in_world, {}});
  return compose({robot_in_map, {}}, mount).transform;
}

}  // namespace

RedundancyFigures evaluate_redundancy(const MapperParameters& p, size_t clouds, uint64_t seed) {
  const World world = furnished_room(seed);
  const WorldCamera camera;
  const DepthCamera pixels = depth_camera_of(camera);
  Lot lot(seed, 2);
  Mapped mapped(p), plain(plain_merge(p));
  const cloud::VoxelSize size(p.map.voxel_m);
  Voxels surfaces;
  size_t seen_points = 0;
  double squares = 0;
  for (size_t i = 0; i < clouds; ++i) {
    const Transform robot = on_circle(i);
    const Look seen = look(world, camera, robot, lot);
    const Transform believed = disturbed(seen.camera_in_world, 0.01, 0.003, lot);
    mapped.add(seen, believed);
    plain.add(seen, believed);
    const Affine m = to_affine(seen.camera_in_world), to_map = to_affine(believed);
    std::set<cloud::VoxelIndex> now;
    for (size_t k = 0; k < seen.depth_m.size(); ++k) {
      const double z = seen.depth_m[k];
      if (!(z > 0 && z < p.range_max_m)) continue;
      const double u = static_cast<double>(k % static_cast<size_t>(camera.width)) - pixels.cu_px,
                   v = static_cast<double>(k / static_cast<size_t>(camera.width)) - pixels.cv_px;
      now.insert(voxel_of(size, transformed(m, u / pixels.focal_px * z, v / pixels.focal_px * z, z)));
    }
    for (const cloud::VoxelIndex& voxel : now) ++surfaces[voxel];
    for (const Point& q : seen.points) {
      if (q.z >= p.range_max_m) continue;
      const Position at = transformed(to_map, q.x, q.y, q.z);
      const double off = distance_m(world, {at.x_m, at.y_m, at.z_m});
      squares += off * off;
      ++seen_points;
    }
  }
  RedundancyFigures out;
  static_cast<MapFigures&>(out) = figures_of(mapped, world, surfaces, size, seen_points);
  out.plain = figures_of(plain, world, surfaces, size, seen_points);
  out.clouds = clouds;
  out.seen_points = seen_points;
  mapped.mapper.map().for_each([&](const Position& at, const MapPoint& point) {
    out.map.points.push_back({static_cast<float>(at.x_m), static_cast<float>(at.y_m), static_cast<float>(at.z_m)});
    out.map.colours.push_back(point.colour);
  });
  out.seen_rms_m = std::sqrt(squares / static_cast<double>(seen_points));
  out.time_ms = quantile(mapped.times_ms, 0.5);
  out.grid = grid_of(mapped.mapper.map(), {});
  return out;
}

GhostFigures evaluate_ghosts(const MapperParameters& p, uint64_t seed) {
  constexpr double kPath_m = 0.8, kHalf_m = 2, kPace_m = 0.3;
  World still = furnished_room(seed);
  still.boxes.pop_back();  // nothing in the middle
  const Transform robot = robot_at(0, -2.2, 0);
  MapperParameters fused = p;
  fused.clear = false;
  Mapped plain_map(plain_merge(p)), fused_map(fused), cleared_map(p);
  Lot lot(seed, 3);
  for (int i = 0; i < 40; ++i) {
    World world = still;
    const double x = -kHalf_m + (i - 5) * kPace_m;
    if (x >= -kHalf_m && x <= kHalf_m) add_person(world, x, kPath_m);
    const Look seen = look(world, {}, robot, lot);
    const Transform pose = disturbed(seen.camera_in_world, 0.01, 0.003, lot);
    for (Mapped* map : {&plain_map, &fused_map, &cleared_map}) map->add(seen, pose);
  }
  const auto ghosts = [&](const Mapped& map) {
    size_t count = 0;
    map.mapper.map().for_each([&](const Position& at, const MapPoint&) {
      const bool on_path =
          std::abs(at.x_m) < kHalf_m + 0.3 && std::abs(at.y_m - kPath_m) < 0.4 && at.z_m > 0.15 && at.z_m < 1.8;
      count += on_path && distance_m(still, {at.x_m, at.y_m, at.z_m}) > 0.2;
    });
    return count;
  };
  return {ghosts(plain_map), ghosts(fused_map), ghosts(cleared_map)};
}

DriveFigures evaluate_drive(const MapperParameters& p, double minutes, uint64_t seed) {
  constexpr double kSpeed_m_s = 0.5;
  constexpr size_t kParts = 10;
  Mapped mapped(p);
  Lot lot(seed, 4);
  DriveFigures out;
  out.map_mb = static_cast<double>(mapped.mapper.map().bytes()) * 1e-6;
  const auto clouds = static_cast<size_t>(minutes * 60 * 1e9 / kPeriodNs);
  for (size_t i = 1; i <= clouds; ++i) {
    const double way_m = kSpeed_m_s * static_cast<double>(i) * kPeriodNs * 1e-9;
    const Look seen = look(long_way(way_m, seed), {}, robot_at(0, way_m, 0), lot);
    mapped.add(seen, disturbed(seen.camera_in_world, 0.01, 0.003, lot));
    if (i % std::max<size_t>(1, clouds / kParts) != 0) continue;
    const TileMap& map = mapped.mapper.map();
    out.parts.push_back({static_cast<double>(i) * kPeriodNs * 1e-9 / 60, way_m, map.tiles(), map.points(),
                         map.dropped(), resident_mb(), quantile(mapped.times_ms, 0.5),
                         quantile(mapped.times_ms, 0.99)});
    mapped.times_ms.clear();
  }
  return out;
}

CorrectionFigures evaluate_correction(const MapperParameters& p, uint64_t seed) {
  constexpr double kDrift_rad = 0.002;  // a step: 9 degrees a round
  const World world = furnished_room(seed);
  const auto steps = static_cast<size_t>(2 * std::numbers::pi * kCircle_m / kStep_m);
  Mapped mapped(p);
  Lot lot(seed, 5);
  UncertainPose believed{on_circle(0), {}};
  const UncertainPose drift{{0, 0, 0, std::cos(kDrift_rad / 2), 0, 0, std::sin(kDrift_rad / 2)}, {}};
  Transform actual = on_circle(0);
  for (size_t i = 0; i <= steps; ++i) {
    if (i > 0) {
      const UncertainPose step = compose(inverse({actual, {}}), {on_circle(i), {}});
      believed = compose(compose(believed, step), drift);
      actual = on_circle(i);
    }
    const Look seen = look(world, {}, actual, lot);
    mapped.add(seen, camera_in(believed.transform, seen, actual));
  }
  CorrectionFigures out;
  out.drift_m = std::hypot(believed.transform.x - actual.x, believed.transform.y - actual.y);
  out.before_m = mapped.rms_m(world);
  mapped.mapper.correct(kPeriodNs, mapped.clouds * kPeriodNs, believed.transform, actual);
  mapped.mapper.tidy();
  out.after_m = mapped.rms_m(world);
  return out;
}

}  // namespace takt::mapping_3d
