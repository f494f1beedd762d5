// SPDX-License-Identifier: Apache-2.0
// SceneUpdate: things in space, with all that Foxglove's schema has, since a definition without it would be another
// one.
#pragma once
#include "graph/world/schemas.hpp"

namespace takt::world {

struct Rgba {
  double r = 0, g = 0, b = 0, a = 0;
  TAKT_SCHEMA(Rgba, "foxglove_msgs/Color", r, g, b, a)
};
struct KeyValuePair {
  std::string_view key, value;
  TAKT_SCHEMA(KeyValuePair, "foxglove_msgs/KeyValuePair", key, value)
};
struct ArrowPrimitive {
  PoseOf pose;
  double shaft_length = 0, shaft_diameter = 0, head_length = 0, head_diameter = 0;
  Rgba color;
  TAKT_SCHEMA(ArrowPrimitive, "foxglove_msgs/ArrowPrimitive", pose, shaft_length, shaft_diameter, head_length,
              head_diameter, color)
};
struct CubePrimitive {
  PoseOf pose;
  Vector3 size;
  Rgba color;
  TAKT_SCHEMA(CubePrimitive, "foxglove_msgs/CubePrimitive", pose, size, color)
};
struct SpherePrimitive {
  PoseOf pose;
  Vector3 size;
  Rgba color;
  TAKT_SCHEMA(SpherePrimitive, "foxglove_msgs/SpherePrimitive", pose, size, color)
};
struct CylinderPrimitive {
  PoseOf pose;
  Vector3 size;
  double bottom_scale = 1, top_scale = 1;
  Rgba color;
  TAKT_SCHEMA(CylinderPrimitive, "foxglove_msgs/CylinderPrimitive", pose, size, bottom_scale, top_scale, color)
};
struct LinePrimitive {
  uint8_t type = 0;
  PoseOf pose;
  double thickness = 0;
  bool scale_invariant = false;
  std::span<const Position> points;
  Rgba color;
  std::span<const Rgba> colors;
  std::span<const uint32_t> indices;
  TAKT_SCHEMA(LinePrimitive, "foxglove_msgs/LinePrimitive", type, pose, thickness, scale_invariant, points, color,
              colors, indices)
};
struct TriangleListPrimitive {
  PoseOf pose;
  std::span<const Position> points;
  Rgba color;
  std::span<const Rgba> colors;
  std::span<const uint32_t> indices;
  TAKT_SCHEMA(TriangleListPrimitive, "foxglove_msgs/TriangleListPrimitive", pose, points, color, colors, indices)
};
struct TextPrimitive {
  PoseOf pose;
  bool billboard = true;  ///< faces whoever looks
  double font_size = 0;
  bool scale_invariant = false;
  Rgba color;
  std::string_view text;
  TAKT_SCHEMA(TextPrimitive, "foxglove_msgs/TextPrimitive", pose, billboard, font_size, scale_invariant, color, text)
};
struct ModelPrimitive {
  PoseOf pose;
  Vector3 scale;
  Rgba color;
  bool override_color = false;
  std::string_view url, media_type;
  std::span<const uint8_t> data;
  TAKT_SCHEMA(ModelPrimitive, "foxglove_msgs/ModelPrimitive", pose, scale, color, override_color, url, media_type, data)
};
struct SceneEntity {
  Time timestamp;
  std::string_view frame_id, id;
  Duration lifetime;  ///< 0: until it is replaced or deleted
  bool frame_locked = false;
  std::span<const KeyValuePair> metadata;
  std::span<const ArrowPrimitive> arrows;
  std::span<const CubePrimitive> cubes;
  std::span<const SpherePrimitive> spheres;
  std::span<const CylinderPrimitive> cylinders;
  std::span<const LinePrimitive> lines;
  std::span<const TriangleListPrimitive> triangles;
  std::span<const TextPrimitive> texts;
  std::span<const ModelPrimitive> models;
  TAKT_SCHEMA(SceneEntity, "foxglove_msgs/SceneEntity", timestamp, frame_id, id, lifetime, frame_locked, metadata,
              arrows, cubes, spheres, cylinders, lines, triangles, texts, models)
};

constexpr uint8_t kDeleteAll = 1;  ///< SceneEntityDeletion::type: every entity of the topic that is older
struct SceneEntityDeletion {
  Time timestamp;
  uint8_t type = kDeleteAll;
  std::string_view id;
  TAKT_SCHEMA(SceneEntityDeletion, "foxglove_msgs/SceneEntityDeletion", timestamp, type, id)
};
struct SceneUpdate {
  std::span<const SceneEntityDeletion> deletions;
  std::span<const SceneEntity> entities;
  TAKT_SCHEMA(SceneUpdate, "foxglove_msgs/SceneUpdate", deletions, entities)
};

}  // namespace takt::world
