// SPDX-License-Identifier: Apache-2.0
// From clouds to the map in a graph of its own, in virtual time: object_3d measures things on a table, semantic_map
// keeps them.
#include <doctest/doctest.h>

#include "tests/unit/compose/drive.hpp"
#include "tests/unit/object_3d/scene_cloud.hpp"

using namespace takt;

namespace {

constexpr size_t kKinds[] = {0, 2, 3};

struct Kept {
  size_t messages = 0, objects = 0, right = 0;
};
Kept kept;  // the node is made by the composition, so it has no other way to tell

/// Shows the same three things with other noise each time, from where the robot stands, and looks at the map.
class Table final : public Node {
 public:
  void setup(Setup&) override {
    for (uint64_t i = 0; i < 4; ++i)
      scenes_.push_back(
          object_3d::make_scene(object_3d::table_models(), {std::begin(kKinds), std::end(kKinds)}, {}, 31, i));
    cloud_.reserve({0, 0, 1, 320 * 240});
  }
  void run(Job& job) override {
    if (const Objects3d* objects = objects_.newest(); objects != nullptr && objects_.is_new()) look(*objects);
    Odometry* odometry = odometry_.loan();
    PointCloud* cloud = cloud_.loan();
    if (cloud == nullptr || odometry == nullptr) return job.no_result();
    odometry->x_m = 3, odometry->y_m = 2, odometry->theta_rad = 0;
    odometry_.send(job.release_ns());
    test::write_scene(scenes_[shown_++ % scenes_.size()], *cloud);
    cloud_.send(job.release_ns());
  }

 private:
  /// The robot looks along the map's x axis, so that what is to its right has a lower y.
  void look(const Objects3d& objects) {
    ++kept.messages;
    kept.objects += objects.objects.size;
    for (const Object3d& object : objects.objects.items())
      for (size_t k = 0; k < 3; ++k)
        if (std::abs(object.y_m - 2 + 0.34f * (static_cast<float>(k) - 1)) < 0.1f && object.x_m > 3.3f)
          kept.right += object.class_id == static_cast<float>(kKinds[k]) && object.height_m > 0.03f;
  }
  std::vector<object_3d::Scene> scenes_;
  size_t shown_ = 0;
  Input<Objects3d> objects_{this, "objects", ""};
  Output<PointCloud> cloud_{this, "cloud", ""};
  Output<Odometry> odometry_{this, "odometry", ""};
};

constexpr const char* kGraphText = R"(takt: 1
name: table
schedule: schedule.yaml
default_profile: sim
devices:
  base: {kind: mobile_base, rate: 5}
profiles:
  sim: {default: {driver: sim, world: @/worlds/lab.xml}}
subsystems:
  table:
    probe: {type: probe, in: {objects: map.objects}}
    object_3d: {type: object_3d, in: {cloud: probe.cloud}, params: {training: @/objects_3d.txt}}
    map:
      type: semantic_map
      in: {things: {from: object_3d.objects, depth: 4}, odometry: {from: probe.odometry, depth: 16}}
      params: {network: @/networks/table.yaml, classes: "carton, book, can, bottle, ball, mug"}
)";
constexpr const char* kScheduleText = R"(takt: 1
name: table
policy: cooperative
cores: [0]
nodes:
  base: {rate: 5, budget: 1ms}
  probe: {rate: 5, offset: 5ms, budget: 5ms, criticality: high}
  object_3d: {rate: 5, offset: 20ms, budget: 20ms}
  map: {rate: 5, offset: 60ms, budget: 5ms}
)";

}  // namespace

TEST_CASE(
    "semantic_map in a graph: three things seen ten times are three objects, where they stand and of their types") {
  kept = {};
  test::Drive::with<Table>(kGraphText, kScheduleText, 2'000'000'000);
  CHECK(kept.messages >= 8);
  CHECK(kept.objects == 3 * kept.messages);
  CHECK(kept.right == kept.objects);
}
