// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cmath>
#include <vector>

#include "rt/msg/ace/objects_3d.hpp"
#include "rt/msg/point_cloud.hpp"
#include "rt/node.hpp"
#include "tests/unit/object_3d/scene_cloud.hpp"

namespace takt::test {

/// Three things side by side on a table: shows them, with other noise in each cloud, and looks at what is said of them.
class TableProbe : public Node {
 public:
  struct {
    size_t clouds = 0, messages = 0, objects = 0;
    size_t right = 0;  ///< objects of the class of what stands there
  } seen;

  void setup(Setup&) override {
    for (uint64_t i = 0; i < 4; ++i)
      scenes_.push_back(
          object_3d::make_scene(object_3d::table_models(), {std::begin(kKinds), std::end(kKinds)}, {}, 31, i));
    cloud_.reserve({0, 0, 1, 320 * 240});
  }
  void run(Job& job) override {
    if (const Objects3d* objects = objects_.newest(); objects != nullptr && objects_.is_new()) look(*objects);
    PointCloud* cloud = cloud_.loan();
    if (cloud == nullptr) return job.no_result();
    write_scene(scenes_[seen.clouds++ % scenes_.size()], *cloud);
    cloud_.send(job.release_ns());
  }

 protected:
  /// The object is where a thing stands that lies so far to the robot's right.
  virtual bool stands_at(const Object3d& object, float right_m) const { return std::abs(object.x_m - right_m) < 0.1f; }

 private:
  static constexpr size_t kKinds[] = {0, 2, 3};

  void look(const Objects3d& objects) {
    ++seen.messages;
    seen.objects += objects.objects.size;
    for (const Object3d& object : objects.objects.items())
      for (size_t k = 0; k < 3; ++k)
        if (stands_at(object, 0.34f * (static_cast<float>(k) - 1)))
          seen.right += object.class_id == static_cast<float>(kKinds[k]);
  }
  std::vector<object_3d::Scene> scenes_;
  Input<Objects3d> objects_{this, "objects", ""};
  Output<PointCloud> cloud_{this, "cloud", ""};
};

}  // namespace takt::test
