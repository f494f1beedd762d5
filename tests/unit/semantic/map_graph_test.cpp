// SPDX-License-Identifier: Apache-2.0
// From clouds to the map in a graph of its own, in virtual time: object_3d measures things on a table, semantic_map
// keeps them.
#include <doctest/doctest.h>

#include "rt/msg/ace/objects_3d.hpp"
#include "rt/msg/odometry.hpp"
#include "tests/unit/compose/drive.hpp"
#include "tests/unit/object_3d/table_probe.hpp"

using namespace takt;

namespace {

/// Says, too, where the robot stands; what it is told of lies in the map.
class TableInMap final : public test::TableProbe {
 public:
  void run(Job& job) override {
    Odometry* odometry = odometry_.loan();
    if (odometry == nullptr) return job.no_result();
    odometry->x_m = kRobot_x_m, odometry->y_m = kRobot_y_m, odometry->theta_rad = 0;
    odometry_.send(job.release_ns());
    TableProbe::run(job);
  }

 private:
  static constexpr float kRobot_x_m = 3, kRobot_y_m = 2;

  /// The robot looks along the map's x axis, so that what is to its right has a lower y.
  bool stands_at(const Object3d& object, float right_m) const override {
    return std::abs(object.y_m - kRobot_y_m + right_m) < 0.1f && object.x_m > kRobot_x_m + 0.3f &&
           object.height_m > 0.03f;
  }
  Output<Odometry> odometry_{this, "odometry", ""};
};

constexpr test::DriveGraph kGraph{
    .devices = R"(
  base: {kind: mobile_base, rate: 5}
)",
    .nodes = R"(
    probe: {type: probe, in: {objects: map.objects}}
    object_3d: {type: object_3d, in: {cloud: probe.cloud}, params: {training: @/objects_3d.txt}}
    map:
      type: semantic_map
      in: {things: {from: object_3d.objects, depth: 4}, odometry: {from: probe.odometry, depth: 16}}
      params: {network: @/networks/table.yaml, classes: "carton, book, can, bottle, ball, mug"}
)",
    .schedule = R"(
  base: {rate: 5, budget: 1ms}
  probe: {rate: 5, offset: 5ms, budget: 5ms, criticality: high}
  object_3d: {rate: 5, offset: 20ms, budget: 20ms}
  map: {rate: 5, offset: 60ms, budget: 5ms}
)",
};

}  // namespace

TEST_CASE(
    "semantic_map in a graph: three things seen ten times are three objects, where they stand and of their types") {
  const test::Drive<TableInMap> drive(kGraph, 2'000'000'000);
  const auto& kept = drive.probe().seen;
  CHECK(kept.messages >= 8);
  CHECK(kept.objects == 3 * kept.messages);
  CHECK(kept.right == kept.objects);
}
