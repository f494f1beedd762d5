// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/msg/pose.hpp>: core, stable.
#pragma once
#include <cstdint>
#include <span>
#include <string_view>

#include "rt/msg/field_list.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/viewer.hpp"

namespace takt {

/// A pose with its covariance (row-major, order x y z rx ry rz).
struct Pose {
  static constexpr std::string_view type_name = "pose";
  Transform transform;
  double covariance[36] = {};
  void show(Viewer& to) const { to.pose(transform, "map"); }
  TAKT_FIELDS(Pose, (transform), (covariance, ""))
};

}  // namespace takt
