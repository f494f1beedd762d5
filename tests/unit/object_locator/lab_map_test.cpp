// SPDX-License-Identifier: Apache-2.0
// From images to the semantic map with nothing of the truth in between: the striped boxes of the lab are detected,
// placed by their disparities and kept, on one round of the simulated robot, whose pose comes from wheels and scans.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "nodes/semantic/reports.hpp"
#include "rt/msg/ace/object_reports.hpp"
#include "rt/transform/planar_pose.hpp"
#include "tests/unit/compose/drive.hpp"

using namespace takt;

namespace {

struct Place {
  std::string type;
  double x_m = 0, y_m = 0;
};
struct Sighting {
  int64_t stamp_ns = 0;
  Place place;  ///< robot frame
};
struct Seen {
  std::map<std::string, Place> kept;  ///< what the map holds at the end, by names
  std::vector<Sighting> sightings;
  size_t looks = 0;
};

class MapProbe final : public Node {
 public:
  Seen seen;

  void setup(Setup&) override {}
  void run(Job&) override {
    if (sighted_.is_new())
      semantic::for_each_report(*sighted_.newest(), [&](const semantic::Report& report) {
        seen.sightings.push_back({sighted_.stamp_ns(), place_of(report)});
      });
    if (!known_.is_new()) return;
    ++seen.looks;
    seen.kept.clear();
    semantic::for_each_report(*known_.newest(), [&](const semantic::Report& report) {
      seen.kept[std::string(report.name)] = place_of(report);
    });
  }

 private:
  static Place place_of(const semantic::Report& report) {
    return {std::string(report.type), report.place.x_m, report.place.y_m};
  }
  Input<ObjectReports> sighted_{this, "seen", ""};
  Input<ObjectReports> known_{this, "known", ""};
};

constexpr test::DriveGraph kGraph{
    .devices = R"(
  head_camera: {kind: stereo_camera, rig: @/rigs/xb3.yaml, rate: 5}
  front_laser: {kind: laser_scanner, model: lms200, rate: 15, mount: {x: 0.0m, y: 0.30m, z: 0.25m, yaw: 0deg}}
  base: {kind: mobile_base, rate: 15}
)",
    .nodes = R"(
    stereo: {type: stereo, in: {pair: head_camera.pair}, params: {disparities: 128, subpixel: true}}
    object_detection: {type: object_detection, in: {pair: head_camera.pair}, params: {database: @/objects}}
    scan_matching:
      type: scan_matching
      in: {scan: {from: front_laser.scan, depth: 4}, odometry: {from: base.odometry, depth: 16}}
    object_locator:
      type: object_locator
      in: {detections: object_detection.detections, disparity: {from: stereo.disparity, depth: 4}, pair: stereo.rectified}
      params: {database: @/objects, half_depth: 0.25m, range_min: 3m}
    map:
      type: semantic_map
      in: {reports: {from: object_locator.reports, depth: 4}, odometry: {from: scan_matching.odometry, depth: 16}}
      params: {network: @/networks/boxes.yaml, distance_max: 1m}
    probe: {type: probe, in: {seen: object_locator.reports, known: map.reports}}
)",
    .schedule = R"(
  head_camera: {rate: 5, budget: 5ms}
  front_laser: {rate: 15, budget: 1ms}
  base: {rate: 15, budget: 1ms}
  stereo: {rate: 5, offset: 10ms, budget: 5ms, criticality: high}
  object_detection: {rate: 5, offset: 20ms, budget: 20ms}
  scan_matching: {rate: 15, offset: 30ms, budget: 5ms}
  object_locator: {rate: 5, offset: 60ms, budget: 1ms}
  map: {rate: 5, offset: 100ms, budget: 1ms}
  probe: {rate: 5, offset: 150ms, budget: 1ms}
)",
};

constexpr double kFills_m = 3;                // nearer boxes are larger than the detector's window
constexpr int64_t kOnce_ns = 72'000'000'000;  // around the lab

PlanarPose pose_of(const sim::RobotState& robot) { return {robot.x_m, robot.y_m, robot.theta_rad}; }

/// In the frame of a robot: x along its heading.
PlanarPose seen_from(const sim::RobotState& robot, const sim::WorldObject& object) {
  return between(pose_of(robot), {object.position.x(), object.position.y(), 0});
}

}  // namespace

TEST_CASE("after a round through the lab the semantic map holds its four boxes, and where they stand") {
  test::Drive<MapProbe> drive(kGraph, kOnce_ns);
  const Seen& seen = drive.probe().seen;
  const sim::Simulation& world = drive.world();
  CHECK(seen.looks > 250);
  CHECK(seen.kept.size() == 4);
  std::vector<double> errors_m;
  size_t boxes = 0;
  for (const sim::WorldObject& object : world.world().objects) {
    if (object.type != "box") continue;
    ++boxes;
    for (const Sighting& sighting : seen.sightings) {
      if (sighting.place.type != object.name) continue;
      const PlanarPose truth = seen_from(world.robot(sighting.stamp_ns), object);
      if (std::hypot(truth.x_m, truth.y_m) < kFills_m) continue;
      errors_m.push_back(std::hypot(sighting.place.y_m - truth.x_m, -sighting.place.x_m - truth.y_m));
    }
    const PlanarPose truth = seen_from(world.robot(world.epoch_ns()), object);
    size_t nodes = 0;
    for (const auto& [name, known] : seen.kept) {
      if (known.type != object.name) continue;
      ++nodes;
      const double off_m = std::hypot(known.x_m - truth.x_m, known.y_m - truth.y_m);
      MESSAGE(name << " is " << off_m << " m off");
      CHECK(off_m < 0.1);
    }
    CHECK(nodes == 1);
  }
  CHECK(boxes == 4);
  REQUIRE(errors_m.size() > 60);
  std::sort(errors_m.begin(), errors_m.end());
  const double median_m = errors_m[errors_m.size() / 2], p90_m = errors_m[errors_m.size() * 9 / 10];
  MESSAGE(errors_m.size() << " sightings from 3 m on: p50 " << median_m << ", p90 " << p90_m << " m off");
  CHECK(median_m < 0.1);
}
