// SPDX-License-Identifier: Apache-2.0
// Things with a place, as a scene: for each a box, or a ball if its size is not known, and its name above it.
#pragma once
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "graph/world/scene_schemas.hpp"
#include "rt/msg/viewer.hpp"

namespace takt::world {

/// Replaces what the topic has shown so far. `things` and `frame` must outlive it.
class Scene {
 public:
  Scene(std::span<const Viewer::Thing> things, std::string_view frame, Time time);
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;
  /// Valid as long as this object.
  SceneUpdate update() const { return {{&deletion_, 1}, entities_}; }

 private:
  /// What the entity of a thing points to.
  struct Parts {
    std::string id, confidence;
    KeyValuePair metadata[2];
    CubePrimitive box;
    SpherePrimitive ball;
    TextPrimitive label;
  };
  SceneEntityDeletion deletion_;
  std::vector<Parts> parts_;
  std::vector<SceneEntity> entities_;
};

}  // namespace takt::world
