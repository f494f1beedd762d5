// SPDX-License-Identifier: Apache-2.0
// The node in a graph of its own, at its rate in virtual time: clouds in, labelled objects out.
#include <doctest/doctest.h>

#include "tests/unit/compose/drive.hpp"
#include "tests/unit/object_3d/scene_cloud.hpp"

using namespace takt;
using namespace takt::object_3d;

namespace {

constexpr size_t kKinds[] = {0, 2, 3};

struct Seen {
  size_t clouds = 0, messages = 0, objects = 0, right = 0;
};
Seen seen;  // the node is made by the composition, so it has no other way to tell

/// Shows one scene after the other and looks at what is said about the one before.
class Table final : public Node {
 public:
  void setup(Setup&) override {
    for (uint64_t i = 0; i < 4; ++i)
      scenes_.push_back(make_scene(table_models(), {std::begin(kKinds), std::end(kKinds)}, {}, 31, i));
    cloud_.reserve({0, 0, 1, 320 * 240});
  }
  void run(Job& job) override {
    if (const Objects3d* objects = objects_.newest(); objects != nullptr && objects_.is_new()) look(*objects);
    PointCloud* cloud = cloud_.loan();
    if (cloud == nullptr) return job.no_result();
    test::write_scene(scenes_[seen.clouds++ % scenes_.size()], *cloud);
    cloud_.send(job.release_ns());
  }

 private:
  void look(const Objects3d& objects) {
    ++seen.messages;
    seen.objects += objects.objects.size;
    for (const Object3d& object : objects.objects.items())  // they stand side by side in their order
      for (size_t k = 0; k < 3; ++k)
        if (std::abs(object.x_m - 0.34f * (static_cast<float>(k) - 1)) < 0.1f)
          seen.right += object.class_id == static_cast<float>(kKinds[k]);
  }
  std::vector<Scene> scenes_;
  Input<Objects3d> objects_{this, "objects", ""};
  Output<PointCloud> cloud_{this, "cloud", ""};
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
    probe: {type: probe, in: {objects: object_3d.objects}}
    object_3d: {type: object_3d, in: {cloud: probe.cloud}, params: {training: @/objects_3d.txt}}
)";
constexpr const char* kScheduleText = R"(takt: 1
name: table
policy: cooperative
cores: [0]
nodes:
  base: {rate: 5, budget: 1ms}
  probe: {rate: 5, offset: 5ms, budget: 5ms, criticality: high}
  object_3d: {rate: 5, offset: 20ms, budget: 20ms}
)";

}  // namespace

TEST_CASE("object_3d at 5 Hz in a graph: each cloud gives its three objects by their names") {
  seen = {};
  test::Drive::with<Table>(kGraphText, kScheduleText, 2'000'000'000);
  CHECK(seen.clouds == 10);
  CHECK(seen.messages >= 8);
  CHECK(seen.objects == 3 * seen.messages);
  CHECK(seen.right == seen.objects);
}
