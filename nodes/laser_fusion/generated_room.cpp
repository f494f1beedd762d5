// SPDX-License-Identifier: Apache-2.0
#include "nodes/laser_fusion/generated_room.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace takt::laser_fusion {
namespace {

using Eigen::Vector3d;

constexpr double kCeiling_m = 2.8;
constexpr int kFurniture = 12;

/// How far along the ray the surface of the box is; nothing if it misses.
std::optional<double> hit(const RoomBox& box, const Vector3d& from, const Vector3d& ray) {
  const auto into_box = [&](const Vector3d& v) -> Vector3d {
    return {box.along.x() * v.x() + box.along.y() * v.y(), box.along.x() * v.y() - box.along.y() * v.x(), v.z()};
  };
  const Vector3d start = into_box(from - box.centre), along = into_box(ray);
  double enter = -std::numeric_limits<double>::infinity(), leave = -enter;
  for (int a = 0; a < 3; ++a) {
    const double low = (-box.half[a] - start[a]) / along[a], high = (box.half[a] - start[a]) / along[a];
    enter = std::max(enter, std::min(low, high));
    leave = std::min(leave, std::max(low, high));
  }
  if (enter > leave || leave < 0) return std::nullopt;
  return enter > 0 ? enter : leave;
}

}  // namespace

std::vector<RoomBox> make_room(double origin_m, Generator& random) {
  const double x = random.uniform(5, 8), y = random.uniform(4, 6);
  std::vector<RoomBox> boxes{{{random.uniform(-0.2, 0.2) * x, random.uniform(-0.2, 0.2) * y, kCeiling_m / 2 - origin_m},
                              {x / 2, y / 2, kCeiling_m / 2},
                              direction_of(random.uniform(0, std::numbers::pi)),
                              random.colour()}};
  while (boxes.size() <= kFurniture) {
    RoomBox box;
    box.half = {random.uniform(0.1, 0.7), random.uniform(0.1, 0.4), random.uniform(0.2, 1.1)};
    const double azimuth = random.uniform(-std::numbers::pi, std::numbers::pi), range = random.uniform(1.3, 3.5);
    box.centre = {range * std::cos(azimuth), range * std::sin(azimuth), box.half.z() - origin_m};
    box.along = direction_of(random.uniform(0, std::numbers::pi));
    box.colour = random.colour();
    boxes.push_back(box);
  }
  return boxes;
}

RayHit first_hit(std::span<const RoomBox> boxes, const Vector3d& from, const Vector3d& ray) {
  RayHit nearest;
  for (size_t i = 0; i < boxes.size(); ++i)
    if (const auto range = hit(boxes[i], from, ray); range && *range < nearest.range_m) nearest = {*range, i};
  return nearest;
}

}  // namespace takt::laser_fusion
