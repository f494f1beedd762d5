// SPDX-License-Identifier: Apache-2.0
#include "graph/world/scene.hpp"

#include <cstdio>

namespace takt::world {
namespace {

constexpr Rgba kBody{0.2, 0.7, 0.3, 0.5}, kLabel{1, 1, 1, 1};
constexpr double kBall_m = 0.2, kLetter_m = 0.15;

std::string two_digits(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f", value);
  return text;
}

}  // namespace

Scene::Scene(std::span<const Viewer::Thing> things, std::string_view frame, Time time)
    : deletion_{time, kDeleteAll, ""} {
  parts_.reserve(things.size());  // entities point into it
  for (const Viewer::Thing& thing : things) {
    Parts& parts = parts_.emplace_back();
    parts.id = std::to_string(parts_.size());
    parts.confidence = two_digits(thing.confidence);
    parts.metadata[0] = {"name", thing.name};
    parts.metadata[1] = {"confidence", parts.confidence};
    const PoseOf pose = pose_of(thing.pose);
    const bool sized = thing.length_m > 0 && thing.width_m > 0 && thing.height_m > 0;
    parts.box = {pose, {thing.length_m, thing.width_m, thing.height_m}, kBody};
    parts.ball = {pose, {kBall_m, kBall_m, kBall_m}, kBody};
    parts.label.pose.position = pose.position;
    parts.label.pose.position.z += (sized ? thing.height_m : kBall_m) / 2 + kLetter_m;
    parts.label.font_size = kLetter_m;
    parts.label.color = kLabel;
    parts.label.text = thing.name;
    SceneEntity entity;
    entity.timestamp = time;
    entity.frame_id = frame;
    entity.id = parts.id;
    entity.metadata = parts.metadata;
    if (sized) entity.cubes = {&parts.box, 1};
    else entity.spheres = {&parts.ball, 1};
    entity.texts = {&parts.label, 1};
    entities_.push_back(entity);
  }
}

}  // namespace takt::world
