// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/ace/objects_3d.hpp>: ace, experimental.
#pragma once
#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "rt/msg/array.hpp"
#include "rt/msg/field_list.hpp"
#include "rt/msg/viewer.hpp"

namespace takt {

/// A thing as one view of it shows it, in the robot frame.
struct Object3d {
  using scalar = float;
  float class_id, score;               ///< class -1: unknown; score 0..1 of the best class
  float x_m, y_m, z_m;                 ///< middle of its box
  float yaw_rad;                       ///< of its length, from the x axis, -pi/2..pi/2
  float length_m, width_m, height_m;   ///< length >= width, both level
  float area_m2, volume_m3;            ///< from above; above its base
  float mass_x_m, mass_y_m, mass_z_m;  ///< centre of mass: mean of its points
  float centre_x_m, centre_y_m;        ///< centre of its area
  float shape_2, shape_3;              ///< eigenvalue ratios l2 / l1, l3 / l1
  float fill;                          ///< area / (length width)
  float blue, green, red;              ///< mean colour, 0..255
  float on, beside;                    ///< indices in the message; on: -1 the support, -2 nothing; beside: -1 nothing
};

/// Things found in a point cloud. Capacity: count.
struct Objects3d {
  static constexpr std::string_view type_name = "objects_3d";
  float searched = 1;                                  ///< share of the seeds, 0..1: less if the job's time ran out
  uint8_t supported = 0;                               ///< 1: a support was found
  double support_a = 0, support_b = 0, support_m = 0;  ///< z = a x + b y + support_m, robot frame
  Array<Object3d> objects;                             ///< in the order of their seeds
  /// Names are numbers of classes: their words are in the file that the classifier reads.
  void show(Viewer& to) const {
    std::vector<Viewer::Thing> things;
    for (const Object3d& o : objects.items())
      things.push_back(
          {o.class_id >= 0 && o.class_id < 1e6f ? "class " + std::to_string(static_cast<int>(o.class_id)) : "unknown",
           {.x = o.x_m, .y = o.y_m, .z = o.z_m, .qw = std::cos(o.yaw_rad / 2), .qz = std::sin(o.yaw_rad / 2)},
           o.length_m,
           o.width_m,
           o.height_m,
           o.score});
    to.things(things, "robot");
  }
  TAKT_FIELDS(Objects3d, (searched, "1"), (supported, ""), (support_a, "1"), (support_b, "1"), (support_m, "m"),
              (objects, ""))
};

}  // namespace takt
