// SPDX-License-Identifier: Apache-2.0
// Generated scenes with known objects, for measurements and tests: things on a table, seen by one stereo camera.
#pragma once
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "nodes/object_3d/finder.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/point.hpp"

namespace takt::object_3d {

enum class Solid : uint8_t { box, cylinder, sphere };  ///< a cylinder stands upright

/// One solid of a model, in the model's frame: origin in the middle of its foot, z up.
struct Part {
  Solid solid = Solid::box;
  double x = 0, y = 0, z = 0;                ///< of its foot, m
  double length = 0, width = 0, height = 0;  ///< along x, y, z; of a cylinder and a sphere length is the diameter
};

struct Model {
  std::string name;
  std::vector<Part> parts;
  cv::Vec3f bgr;
};

/// Kinds of things, each in its middle size: carton, book, can, bottle, ball, mug; and some that belong to no kind.
std::vector<Model> table_models();
std::vector<Model> strange_models();

struct PlacedModel {
  size_t kind = 0;  ///< index of the model it was made from
  Model model;      ///< with its own sizes and colour
  double x = 0, y = 0, yaw_rad = 0;
};

struct SceneParameters {
  double focal_px = 492.8, baseline_m = 0.24;  ///< 640 x 480, 66 deg
  int step_px = 2;
  double camera_height_m = 1.40, camera_tilt_rad = -0.61, table_m = 0.75;
  double disparity_sigma_px = 0.2;
  double flying_share = 0.3;  ///< of the pixels at a step in depth: their depth lies anywhere between the two sides
  double size_spread = 0.08;  ///< sizes are drawn from 1 -+ this times the middle one, each by itself
  double colour_spread = 15;  ///< levels, of each channel of an object
  double light_min = 0.7, light_max = 1.3;
  double noise_sigma = 3;  ///< levels, of each point
};

struct Scene {
  std::vector<Point> points;
  std::vector<Colour> colours;
  std::vector<int> object;  ///< of each point: index in `placed`, -1 for everything else
  CameraModel camera;
  int step_px = 0;
  Transform sensor_in_robot;
  std::vector<PlacedModel> placed;

  SensorCloud cloud() const { return {points, colours, camera, step_px, sensor_in_robot}; }
};

/// Scene number `index` of a seed: models of these kinds side by side, left to right as in `kinds`, turned and sized at
/// random. Equal arguments give equal scenes.
Scene make_scene(const std::vector<Model>& models, const std::vector<size_t>& kinds, const SceneParameters& parameters,
                 uint64_t seed, uint64_t index);

/// A model as it is.
Scene make_scene_of(const std::vector<PlacedModel>& placed, const SceneParameters& parameters, cv::RNG& random);

}  // namespace takt::object_3d
