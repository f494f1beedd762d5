// SPDX-License-Identifier: Apache-2.0
// The pose joined from wheels, ego-motion and scan matching on a drive through the lab, against the world's ground
// truth; and on the same drive with a laser that falls silent.
#include <doctest/doctest.h>

#include <cmath>
#include <string>

#include "nodes/mapping_3d/pose.hpp"
#include "nodes/scan_matching/planar.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/msg/pose.hpp"
#include "tests/unit/compose/drive.hpp"

using namespace takt;

namespace {

struct Known {
  int64_t stamp_ns = 0;
  PlanarPose robot_in_map;
  scan_matching::Covariance covariance = scan_matching::Covariance::Zero();
};
struct SeenPoses {
  Known wheels, scans, joined;
};

class PoseProbe final : public Node {
 public:
  SeenPoses seen;

  void setup(Setup&) override {}
  void run(Job&) override {
    if (const Odometry* odometry = wheels_.newest())
      seen.wheels = {wheels_.stamp_ns(), planar(mapping_3d::robot_in_odometry(*odometry)),
                     scan_matching::Covariance::Zero()};
    keep(scans_, seen.scans);
    keep(joined_, seen.joined);
  }

 private:
  static PlanarPose planar(const Transform& transform) { return scan_matching::planar(transform); }
  static void keep(const Input<Pose>& port, Known& known) {
    const Pose* pose = port.newest();
    if (!pose) return;
    PoseCovariance covariance;
    std::copy(std::begin(pose->covariance), std::end(pose->covariance), covariance.begin());
    known = {port.stamp_ns(), planar(pose->transform), scan_matching::planar(covariance)};
  }
  Input<Odometry> wheels_{this, "wheels", ""};
  Input<Pose> scans_{this, "scans", ""};
  Input<Pose> joined_{this, "joined", ""};
};

constexpr test::DriveGraph kRobotPoseGraph{
    .devices = R"(
  head_camera: {kind: stereo_camera, rig: @/rigs/xb3.yaml, rate: 10}
  front_laser: {kind: laser_scanner, model: lms200, rate: 15, mount: {x: 0.0m, y: 0.30m, z: 0.25m, yaw: 0deg}}
  base: {kind: mobile_base, rate: 15}
)",
    .nodes = R"(
    stereo: {type: stereo, in: {pair: head_camera.pair}}
    ego_motion: {type: ego_motion, in: {pair: stereo.rectified, disparity: stereo.disparity}, join: [pair, disparity]}
    scan_matching:
      type: scan_matching
      in: {scan: {from: front_laser.scan, depth: 4}, odometry: {from: base.odometry, depth: 16}}
    robot_pose:
      type: robot_pose
      in:
        odometry: {from: base.odometry, depth: 16}
        motion: {from: ego_motion.motion, depth: 16}
        robot_motion: {from: ego_motion.robot_motion, depth: 16}
        scan_pose: {from: scan_matching.pose, depth: 16}
    probe: {type: probe, in: {wheels: base.odometry, scans: scan_matching.pose, joined: robot_pose.pose}}
)",
    .schedule = R"(
  head_camera: {rate: 10, budget: 5ms}
  front_laser: {rate: 15, budget: 1ms}
  base: {rate: 15, budget: 1ms}
  stereo: {rate: 10, offset: 10ms, budget: 5ms, criticality: high}
  ego_motion: {rate: 10, offset: 20ms, budget: 5ms}
  scan_matching: {rate: 5, offset: 30ms, budget: 5ms}
  robot_pose: {rate: 10, offset: 50ms, budget: 1ms}
  probe: {rate: 10, offset: 60ms, budget: 1ms}
)",
};

struct Off {
  double metres, degrees;
};

/// Against the robot's true pose at the stamp, in the frame of its start: x along its heading, as the odometry has it.
Off off(const Known& known, const sim::Simulation& world) {
  const auto pose = [&](int64_t at_ns) {
    const sim::RobotState robot = world.robot(at_ns);
    return PlanarPose{robot.x_m, robot.y_m, robot.theta_rad};
  };
  PlanarPose truth = between(pose(world.epoch_ns()), pose(known.stamp_ns));
  truth.theta_rad -= std::numbers::pi / 2;  // the robot drives along its y axis
  const PlanarPose error = between(truth, known.robot_in_map);
  return {std::hypot(error.x_m, error.y_m), std::abs(error.theta_rad) * 180 / std::numbers::pi};
}

}  // namespace

TEST_CASE("wheels, ego-motion and scans joined are better than wheels, with the laser or with half a drive of it") {
  constexpr int64_t kDrive_ns = 24'000'000'000;
  for (const bool laser_fails : {false, true}) {
    CAPTURE(laser_fails);
    std::string devices(kRobotPoseGraph.devices);
    if (laser_fails) devices.insert(devices.find(", mount: "), ", failures: \"silent 12s..60s\"");
    test::DriveGraph graph = kRobotPoseGraph;
    graph.devices = devices;
    test::Drive<PoseProbe> drive(graph, kDrive_ns);
    const SeenPoses& seen = drive.probe().seen;
    const sim::Simulation& world = drive.world();
    const Off wheels = off(seen.wheels, world), scans = off(seen.scans, world), joined = off(seen.joined, world);
    MESSAGE("wheels off by " << wheels.metres << " m, " << wheels.degrees << " deg; scans " << scans.metres << ", "
                             << scans.degrees << "; joined " << joined.metres << ", " << joined.degrees
                             << "; standard deviations " << std::sqrt(seen.joined.covariance(0, 0)) << ", "
                             << std::sqrt(seen.joined.covariance(1, 1)) << " m");
    CHECK(seen.joined.stamp_ns > world.epoch_ns() + kDrive_ns - 300'000'000);
    CHECK((seen.scans.stamp_ns < world.epoch_ns() + kDrive_ns / 2 + 500'000'000) == laser_fails);
    CHECK(joined.metres < 0.5 * wheels.metres);
    CHECK(joined.degrees < 0.5 * wheels.degrees);
  }
}
