// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/ace/body_poses.hpp>: ace, experimental.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string_view>
#include <vector>

#include "rt/msg/array.hpp"
#include "rt/msg/field_list.hpp"
#include "rt/msg/viewer.hpp"

namespace takt {

/// Where a joint of a body is. fitted 1: a point shows it; 0.5: it must be hidden behind one, and its limb has the
/// length that it should have; 0: it could not be found, and x, y, z are 0.
struct BodyJoint {
  float x, y, z, fitted;
};

/// From a joint along a limb, as from the shoulder through the wrist. dx, dy, dz a unit vector; 0 0 0: a joint of it is
/// missing.
struct PointingRay {
  float x, y, z, dx, dy, dz;
};

/// One body. Joints as the skeleton file numbers them, joint 0 its start; those beyond its joints are 0.
struct Body {
  using scalar = float;
  static constexpr size_t kMostJoints = 16, kMostPointers = 2;
  float error;    ///< of the fit (thesis Eq. 3.10), less is better
  float valid;    ///< 1: lengths and angles pass Eq. 3.11
  float yaw_rad;  ///< of its frame about the vertical, 0: faces along +y
  float top_m;    ///< height above the floor
  BodyJoint joints[kMostJoints];
  PointingRay pointing[kMostPointers];

  /// The box around its joints that were found, along the axes of the robot.
  Viewer::Thing box() const {
    constexpr float kFar = std::numeric_limits<float>::max();
    float least[3]{kFar, kFar, kFar}, most[3]{-kFar, -kFar, -kFar};
    for (const BodyJoint& joint : joints) {
      if (!(joint.fitted > 0)) continue;
      const float at[3]{joint.x, joint.y, joint.z};
      for (int i = 0; i < 3; ++i) least[i] = std::min(least[i], at[i]), most[i] = std::max(most[i], at[i]);
    }
    if (!(least[0] <= most[0])) return {"person", {}, 0, 0, 0, 0};  // no joint was found
    return {"person",
            {.x = (least[0] + most[0]) / 2, .y = (least[1] + most[1]) / 2, .z = (least[2] + most[2]) / 2},
            most[0] - least[0],
            most[1] - least[1],
            most[2] - least[2],
            valid > 0 ? 1.0 : 0.0};
  }
};

/// Bodies and their joints in the robot frame, nearest first. Capacity: count.
struct BodyPoses {
  static constexpr std::string_view type_name = "body_poses";
  int32_t joints = 0;      ///< of the skeleton, its start included
  int32_t candidates = 0;  ///< clusters that could have been bodies
  float searched = 1;      ///< share of their poses tried, 0..1: less if the job's time ran out
  Array<Body> bodies;
  void show(Viewer& to) const {
    std::vector<Viewer::Thing> people;
    for (const Body& body : bodies.items())
      if (Viewer::Thing box = body.box(); box.length_m > 0 || box.confidence > 0) people.push_back(std::move(box));
    to.things(people, "robot");
  }
  TAKT_FIELDS(BodyPoses, (joints, "1"), (candidates, "1"), (searched, "1"), (bodies, ""))
};

}  // namespace takt
