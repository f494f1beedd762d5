// SPDX-License-Identifier: Apache-2.0
// One line for people: what is held back, and what lies ahead. No allocation; any thread.
#pragma once
#include <optional>
#include <span>
#include <string_view>

#include "rt/msg/grid.hpp"
#include "rt/msg/requests.hpp"

namespace takt::semantic {

/// How far the robot can drive straight on before the nearest occupied cell (more than half, R-15.3)
/// that reaches into a strip of that width about the y axis; 0 if it stands in one. None if the strip is free or
/// unknown. The grid lies in the robot frame (x right, y forward).
std::optional<double> free_way_m(const Grid& grid, double strip_m);

/// What the line tells; an absent value is not mentioned.
struct Status {
  uint32_t stop_reasons = 0;
  bool stop_lost = false;
  std::span<const Request> deviating;
  std::optional<uint32_t> objects;
  std::optional<double> obstacle_m, ground_m;
};

/// Writes as much as fits and returns what was written: "robot stopped: obstacle | stopped: object_detection | paced:
/// ground_map/2 | objects: 3 | obstacle ahead: 2.4 m".
std::string_view write_status(const Status& status, std::span<char> into);

}  // namespace takt::semantic
