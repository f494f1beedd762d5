// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/ace/terrain.hpp>: ace, experimental.
#pragma once
#include <cstdint>
#include <span>
#include <string_view>

#include "rt/msg/field_list.hpp"

namespace takt {

/// What the floor around a robot is like; left: the robot is on its left side.
namespace terrain_kind {
constexpr uint8_t left = 0, right = 1, middle = 2, crossing = 3, unknown = 4;
}

/// Judged from an occupancy grid around the robot.
struct Terrain {
  static constexpr std::string_view type_name = "terrain";
  uint8_t kind = terrain_kind::unknown;  ///< the strongest hypothesis
  float hypotheses[5] = {};              ///< 0..1 for each terrain_kind
  float correlations[4] = {};            ///< -1..1 of the newest map with that of a kind; 0: too little is known
  TAKT_FIELDS(Terrain, (kind, ""), (hypotheses, "1"), (correlations, "1"))
};

}  // namespace takt
