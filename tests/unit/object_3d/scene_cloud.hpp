// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "nodes/object_3d/scenes.hpp"
#include "rt/msg/point_cloud.hpp"

namespace takt::test {

/// The scene as a camera's cloud; as much as the message has room for.
inline void write_scene(const object_3d::Scene& scene, PointCloud& cloud) {
  cloud.camera = scene.camera;
  cloud.step_px = scene.step_px;
  cloud.sensor_in_robot = scene.sensor_in_robot;
  for (size_t i = 0; i < scene.points.size(); ++i) {
    cloud.points.push_back(scene.points[i]);
    cloud.colours.push_back(scene.colours[i]);
  }
}

}  // namespace takt::test
