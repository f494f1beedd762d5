// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/ace/object_reports.hpp>: ace, experimental.
#pragma once
#include <algorithm>
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

/// What an object is called and of which type it is, as the semantic network has it; ended by 0.
struct ObjectName {
  using scalar = char;
  char name[32] = {};  ///< empty: a thing just seen, which nobody has named yet
  char type[32] = {};
};
struct ObjectPlace {
  using scalar = float;
  float x_m, y_m, z_m, yaw_rad;
  float score;       ///< 0..1: how sure the type is
  float attributes;  ///< how many of ObjectReports::attributes are its own; they follow those of the object before
};
struct ObjectAttribute {
  using scalar = char;
  char name[32] = {};
  char value[32] = {};  ///< as a network file writes it
};

/// Objects as the semantic network knows them, by names, so that ends with different networks understand each other.
/// names and places have one entry an object. Capacity: count (objects; eight times as many attributes).
struct ObjectReports {
  static constexpr std::string_view type_name = "object_reports";
  uint8_t in_map = 0;  ///< 0: places in the robot frame; 1: in the map frame
  Array<ObjectName> names;
  Array<ObjectPlace> places;
  Array<ObjectAttribute> attributes;
  void show(Viewer& to) const {
    std::vector<Viewer::Thing> things;
    for (uint32_t i = 0; i < std::min(names.size, places.size); ++i) {
      const ObjectPlace& p = places[i];
      const auto text = [](const char(&of)[32]) { return std::string(of, std::find(of, of + 32, '\0')); };
      const std::string name = text(names[i].name), type = text(names[i].type);
      things.push_back(
          {name.empty() ? type : name + " (" + type + ")",
           {.x = p.x_m, .y = p.y_m, .z = p.z_m, .qw = std::cos(p.yaw_rad / 2), .qz = std::sin(p.yaw_rad / 2)},
           0,
           0,
           0,
           p.score});
    }
    to.things(things, in_map != 0 ? "map" : "robot");
  }
  TAKT_FIELDS(ObjectReports, (in_map, ""), (names, ""), (places, ""), (attributes, "", 8 * capacity.count))
};

}  // namespace takt
