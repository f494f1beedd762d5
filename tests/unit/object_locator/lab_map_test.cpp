// SPDX-License-Identifier: Apache-2.0
// From images to the semantic map with nothing of the truth in between: the striped boxes of the lab are detected,
// placed by their disparities and kept, on one round of the simulated robot, whose pose comes from wheels and scans.
#include <doctest/doctest.h>

#include <cmath>
#include <map>

#include "nodes/semantic/reports.hpp"
#include "rt/transform/planar_pose.hpp"
#include "tests/unit/compose/drive.hpp"

using namespace takt;

namespace {

struct Kept {
  std::string type;
  double x_m = 0, y_m = 0;
};
/// What the map holds at the end, and how far it was off the robot's own pose; the node is made by the composition, so
/// it has no other way to tell.
std::map<std::string, Kept> kept;
size_t looks = 0;

class MapProbe final : public Node {
 public:
  void setup(Setup&) override {}
  void run(Job&) override {
    const ObjectReports* reports = reports_.newest();
    if (reports == nullptr || !reports_.is_new()) return;
    ++looks;
    kept.clear();
    semantic::for_each_report(*reports, [](const semantic::Report& report) {
      kept[std::string(report.name)] = {std::string(report.type), report.place.x_m, report.place.y_m};
    });
  }

 private:
  Input<ObjectReports> reports_{this, "reports", ""};
};

constexpr const char* kGraphText = R"(takt: 1
name: boxes
schedule: schedule.yaml
default_profile: sim
devices:
  head_camera: {kind: stereo_camera, rig: @/rigs/xb3.yaml, rate: 5}
  front_laser: {kind: laser_scanner, model: lms200, rate: 15, mount: {x: 0.0m, y: 0.30m, z: 0.25m, yaw: 0deg}}
  base: {kind: mobile_base, rate: 15}
profiles:
  sim: {default: {driver: sim, world: @/worlds/lab.xml}}
subsystems:
  robot:
    stereo: {type: stereo, in: {pair: head_camera.pair}, params: {disparities: 128, subpixel: true}}
    object_detection: {type: object_detection, in: {pair: head_camera.pair}, params: {database: @/objects}}
    scan_matching:
      type: scan_matching
      in: {scan: {from: front_laser.scan, depth: 4}, odometry: {from: base.odometry, depth: 16}}
    object_locator:
      type: object_locator
      in: {detections: object_detection.detections, disparity: {from: stereo.disparity, depth: 4}, pair: stereo.rectified}
      params: {database: @/objects, half_depth: 0.25m}
    map:
      type: semantic_map
      in: {reports: {from: object_locator.reports, depth: 4}, odometry: {from: scan_matching.odometry, depth: 16}}
      params: {network: @/networks/boxes.yaml, distance_max: 1m}
    probe: {type: probe, in: {reports: map.reports}}
)";
constexpr const char* kScheduleText = R"(takt: 1
name: boxes
policy: cooperative
cores: [0]
nodes:
  head_camera: {rate: 5, budget: 5ms}
  front_laser: {rate: 15, budget: 1ms}
  base: {rate: 15, budget: 1ms}
  stereo: {rate: 5, offset: 10ms, budget: 5ms, criticality: high}
  object_detection: {rate: 5, offset: 20ms, budget: 20ms}
  scan_matching: {rate: 15, offset: 30ms, budget: 5ms}
  object_locator: {rate: 5, offset: 60ms, budget: 1ms}
  map: {rate: 5, offset: 100ms, budget: 1ms}
  probe: {rate: 5, offset: 150ms, budget: 1ms}
)";

constexpr int64_t kOnce_ns = 72'000'000'000;  // around the lab

}  // namespace

TEST_CASE("after a round through the lab the semantic map holds its four boxes, and where they stand") {
  auto drive = test::Drive::with<MapProbe>(kGraphText, kScheduleText, kOnce_ns);
  const sim::Simulation& world = drive.world();
  const sim::RobotState begin = world.robot(world.epoch_ns());
  const PlanarPose map{begin.x_m, begin.y_m, begin.theta_rad};
  CHECK(looks > 250);
  for (const auto& [name, object] : kept) MESSAGE(name << " at " << object.x_m << " " << object.y_m);
  for (const sim::WorldObject& object : world.world().objects) {
    if (object.type != "box") continue;
    const PlanarPose truth = between(map, {object.position.x(), object.position.y(), 0});
    double nearest_m = 1e9;
    size_t nodes = 0;
    for (const auto& [name, known] : kept) {
      if (known.type != object.name) continue;
      ++nodes;
      nearest_m = std::min(nearest_m, std::hypot(known.x_m - truth.x_m, known.y_m - truth.y_m));
    }
    MESSAGE(object.name << ": " << nodes << " in the map, the nearest " << nearest_m << " m off");
    CHECK(nodes == 1);
    CHECK(nearest_m < 0.2);
  }
  CHECK(kept.size() == 4);
}
