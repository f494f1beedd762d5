// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/msg/point_cloud.hpp>: core, stable.
#pragma once
#include <cstdint>
#include <span>
#include <string_view>

#include "rt/msg/array.hpp"
#include "rt/msg/field_list.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/point.hpp"
#include "rt/msg/viewer.hpp"

namespace takt {

/// Coloured points in the frame of the sensor. Capacity: count.
struct PointCloud {
  static constexpr std::string_view type_name = "point_cloud";
  Transform sensor_in_robot;
  CameraModel camera;   ///< of the image the cloud was triangulated from; zero for other sensors
  int32_t step_px = 0;  ///< one point per step x step pixels of that image; 0 for other sensors
  Array<Point> points;
  Array<Colour> colours;  ///< same size as points, or empty
  void show(Viewer& to) const {
    to.cloud(points.items(), colours.items());
    to.mounted(sensor_in_robot);
  }
  TAKT_FIELDS(PointCloud, (sensor_in_robot), (camera), (step_px, "px"), (points, "m"), (colours, "1"))
};

}  // namespace takt
