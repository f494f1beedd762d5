// SPDX-License-Identifier: Apache-2.0
// The whole spine on the simulated world, in virtual time, against the world's ground truth: what no test of one room
// can see, such as a camera's mount that gets lost between device and mapping.
#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "rt/msg/disparity.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/grid.hpp"
#include "rt/msg/motion.hpp"
#include "tests/unit/compose/drive.hpp"
#include "tests/unit/compose/isometry.hpp"

using namespace takt;
using test::isometry;

namespace {

/// What the probe saw last.
struct SeenByStereo {
  int64_t disparity_stamp = 0, motion_stamp = 0, grid_stamp = 0;
  int32_t width = 0;
  std::vector<int16_t> disparity;
  Transform pose;
  double cell_m = 0, origin_m = 0;
  int32_t cells_per_side = 0;
  std::vector<int16_t> cells;
};

class ProbeNode final : public Node {
 public:
  SeenByStereo seen;

  void setup(Setup&) override {}
  void run(Job&) override {
    if (const DisparityMap* map = disparity_.newest()) {
      seen.disparity.assign(map->disparity.items().begin(), map->disparity.items().end());
      seen.width = map->width;
      seen.disparity_stamp = disparity_.stamp_ns();
    }
    if (const Motion* motion = motion_.newest()) {
      seen.pose = motion->pose;
      seen.motion_stamp = motion_.stamp_ns();
    }
    if (const Grid* grid = obstacles_.newest()) {
      seen.cells.assign(grid->cells.items().begin(), grid->cells.items().end());
      seen.cell_m = grid->cell_m;
      seen.origin_m = grid->origin_x_m;
      seen.cells_per_side = grid->width;
      seen.grid_stamp = obstacles_.stamp_ns();
    }
  }

 private:
  Input<DisparityMap> disparity_{this, "disparity", ""};
  Input<Motion> motion_{this, "motion", ""};
  Input<Grid> obstacles_{this, "obstacles", ""};
};

constexpr test::DriveGraph kStereoGraph{
    .devices = R"(
  head_camera: {kind: stereo_camera, rig: @/rigs/xb3.yaml, rate: 15}
  base: {kind: mobile_base, rate: 15}
)",
    .nodes = R"(
    stereo: {type: stereo, in: {pair: head_camera.pair}}
    ego_motion:
      type: ego_motion
      in: {pair: stereo.rectified, disparity: stereo.disparity}
      join: [pair, disparity]
    mapping_3d: {type: mapping_3d, in: {cloud: stereo.cloud, motion: {from: ego_motion.motion, depth: 16}}}
    probe: {type: probe, in: {disparity: stereo.disparity, motion: ego_motion.motion, obstacles: mapping_3d.obstacles}}
)",
    .schedule = R"(
  head_camera: {rate: 15, budget: 5ms}
  base: {rate: 15, budget: 1ms}
  stereo: {rate: 15, offset: 10ms, budget: 5ms, criticality: high}
  ego_motion: {rate: 15, offset: 20ms, budget: 5ms}
  mapping_3d: {rate: 15, offset: 30ms, budget: 5ms}
  probe: {rate: 15, offset: 50ms, budget: 1ms}
)",
};

}  // namespace

TEST_CASE("stereo, ego-motion and the obstacle grid agree with the simulated world") {
  test::Drive<ProbeNode> drive(kStereoGraph, 6'000'000'000);
  const SeenByStereo& seen = drive.probe().seen;
  const sim::Simulation& world = drive.world();
  const StereoRig rig = test::rig_of("head_camera", "xb3.yaml");
  const auto pixels = static_cast<size_t>(rig.width) * static_cast<size_t>(rig.height);

  // Disparity: integer disparities, so half a pixel off is perfect.
  std::vector<float> truth(pixels);
  world.true_disparity(rig, seen.disparity_stamp, truth.data());
  REQUIRE(seen.disparity.size() == pixels);
  size_t valid = 0, good = 0;
  for (size_t i = 0; i < pixels; ++i) {
    if (seen.disparity[i] < 0) continue;
    ++valid;
    good += std::abs(static_cast<float>(seen.disparity[i]) - truth[i]) <= 1.0f;
  }
  MESSAGE("disparity: density " << 100.0 * static_cast<double>(valid) / static_cast<double>(pixels)
                                << " %, within 1 px " << 100.0 * static_cast<double>(good) / static_cast<double>(valid)
                                << " %");
  CHECK(static_cast<double>(valid) > 0.8 * static_cast<double>(pixels));
  CHECK(static_cast<double>(good) > 0.9 * static_cast<double>(valid));

  // Motion: the pose of the camera in the frame of its first exposure.
  const Eigen::Isometry3d first = isometry(world.camera_pose(rig, 0, world.epoch_ns())),
                          last = isometry(world.camera_pose(rig, 0, seen.motion_stamp)),
                          error = (first.inverse() * last).inverse() * isometry(seen.pose);
  const double path_m = (last.translation() - first.translation()).norm();
  const double turn = Eigen::AngleAxisd(error.rotation()).angle();
  MESSAGE("motion: " << path_m << " m, off by " << error.translation().norm() << " m and " << turn * 57.2958 << " deg");
  CHECK(path_m > 1.5);
  CHECK(error.translation().norm() < 0.03 * path_m);
  CHECK(turn < 0.02);

  // Obstacles: what stands in view is marked, and nothing stands in a free cell.
  world.true_depth(rig, seen.grid_stamp, truth.data());
  const Eigen::Isometry3d mount = isometry(camera_in_robot(rig, 0, 0));
  const auto cell = [&](double x, double y) {
    const int column = static_cast<int>(std::floor((x - seen.origin_m) / seen.cell_m)),
              row = static_cast<int>(std::floor((y - seen.origin_m) / seen.cell_m));
    const bool inside = column >= 0 && row >= 0 && column < seen.cells_per_side && row < seen.cells_per_side;
    return inside ? seen.cells[static_cast<size_t>(row * seen.cells_per_side + column)] : Grid::unknown;
  };
  size_t standing = 0, marked = 0, in_free = 0;
  for (int v = 0; v < rig.height; v += 4)
    for (int u = 0; u < rig.width; u += 4) {
      const double depth = truth[static_cast<size_t>(v * rig.width + u)];
      const Eigen::Vector3d p = mount * Eigen::Vector3d(depth * (u - rig.cu_px) / rig.focal_px,
                                                        depth * (v - rig.cv_px) / rig.focal_px, depth);
      if (depth <= 0 || p.z() < 0.3 || p.z() > 1.6 || p.y() < 1.0 || p.y() > 5.0) continue;
      ++standing;
      bool near = false;
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) near = near || cell(p.x() + dx * seen.cell_m, p.y() + dy * seen.cell_m) > 0;
      marked += near;
      in_free += cell(p.x(), p.y()) == 0;
    }
  MESSAGE("obstacles: " << standing << " points stand in view, marked " << marked << ", in free cells " << in_free);
  REQUIRE(standing > 1000);
  CHECK(static_cast<double>(marked) > 0.9 * static_cast<double>(standing));
  CHECK(static_cast<double>(in_free) < 0.05 * static_cast<double>(standing));
}
