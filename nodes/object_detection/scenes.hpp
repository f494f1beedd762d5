// SPDX-License-Identifier: Apache-2.0
// Generated scenes with known objects, for measurements.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "nodes/object_detection/database.hpp"

namespace takt::object_detection {

struct PlacedObject {
  size_t object;        ///< index in the database
  int x, y, side;       ///< square that the scaled view takes, px
  double occluded = 0;  ///< share of the object behind an occluder, 0..1
};

struct Scene {
  int width = 0, height = 0;
  std::vector<uint8_t> pixels;  ///< BGR
  std::vector<PlacedObject> objects;

  ImageView<const uint8_t> view() const { return {pixels.data(), width, height, 3}; }
};

struct SceneParameters {
  int width = 640, height = 480;
  ImageView<const uint8_t> background;       ///< of that size, BGR; without data it is generated
  int fewest_objects = 0, most_objects = 3;  ///< in each scene, apart from one another
  double scale_min = 0.8, scale_max = 1.2;
  double light_min = 0.5, light_max = 1.5;  ///< factor on the whole scene, cut off at 255
  double noise_sigma = 3;
  double occlusion_max = 0;  ///< an occluder of one colour hides 0 .. occlusion_max of each object, from one side
};

/// Scene number `index` of a seed: test views of random objects, cut out by their mask, scaled and put at random whole
/// pixels on a background, given or of coloured noise at several scales with rectangles of random colours; then the
/// light, then noise. Equal arguments give equal scenes. Throws std::invalid_argument if an object has no test view.
Scene make_scene(std::span<const DatabaseObject> database, const SceneParameters& parameters, uint64_t seed,
                 uint64_t index);

}  // namespace takt::object_detection
