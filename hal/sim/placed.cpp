// SPDX-License-Identifier: Apache-2.0
#include "hal/sim/placed.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace takt::sim {
namespace {

constexpr double kPersonRadius = 0.3;   // m, of the circle that a person needs
constexpr double kAboveTheRobot = 1.8;  // m: what hangs higher does not touch it
constexpr double kNever = std::numeric_limits<double>::infinity();

/// In the frame of a placed box.
Vec2 local(const Placed& placed, const Vec2& v) {
  const double c = std::cos(placed.yaw_rad), s = std::sin(placed.yaw_rad);
  return {c * v.x() + s * v.y(), -s * v.x() + c * v.y()};
}

/// How far outside of the outline along each axis, not negative.
Vec2 beyond(const Placed& placed, const Vec2& point) {
  const Vec2 p = local(placed, point - placed.position);
  return {std::max(std::abs(p.x()) - placed.shape->box->width_m / 2, 0.0),
          std::max(std::abs(p.y()) - placed.shape->box->depth_m / 2, 0.0)};
}

double cast_sphere(const Vec3& centre, double radius, const Vec3& o, const Vec3& d) {
  const Vec3 rel = o - centre;
  const double b = rel.dot(d), h = b * b - rel.squaredNorm() + radius * radius;
  const double t = -b - std::sqrt(std::max(h, 0.0));
  return h >= 0 && t > 0 ? t : kNever;
}

double cast_capsule(const Capsule& capsule, const Vec3& o, const Vec3& d) {
  const Vec3 axis = capsule.b - capsule.a, rel = o - capsule.a;
  const double axx = axis.squaredNorm(), ad = axis.dot(d), ar = axis.dot(rel);
  const double a = axx - ad * ad, b = axx * rel.dot(d) - ar * ad;
  const double c = axx * rel.squaredNorm() - ar * ar - capsule.radius * capsule.radius * axx;
  const double h = b * b - a * c;
  double nearest = std::min(cast_sphere(capsule.a, capsule.radius, o, d), cast_sphere(capsule.b, capsule.radius, o, d));
  if (h >= 0 && a > 1e-12) {
    const double t = (-b - std::sqrt(h)) / a, along = ar + t * ad;
    if (t > 0 && along > 0 && along < axx) nearest = std::min(nearest, t);
  }
  return nearest;
}

void add_shirt(Scene& scene, const Placed& placed) {
  const Person& person = *placed.shape->person;
  const double k = person.height_m / 1.75, c = std::cos(placed.yaw_rad), s = std::sin(placed.yaw_rad);
  for (const double side : {1.0, -1.0}) {
    const double ahead = side * k * 0.17;  // the torso is 0.15 m thick
    add_board(scene, {placed.position.x() + ahead * c, placed.position.y() + ahead * s, k * 0.92}, k * kShirtEdge,
              placed.yaw_rad + (side > 0 ? 0 : std::numbers::pi), person.shirt);
  }
}

const Shape& shape_at_first(const WorldObject& object) {
  for (const Look& look : object.looks) {
    const bool holds = std::all_of(look.when.begin(), look.when.end(), [&](const Condition& condition) {
      const auto value = object.attributes.find(condition.attribute);
      return value != object.attributes.end() && value->second == condition.value;
    });
    if (holds) return look.shape;
  }
  return object;
}

}  // namespace

Placed as_it_begins(const WorldObject& object) { return {&shape_at_first(object), object.position, object.yaw_rad, 0}; }

void add_placed(Scene& scene, const Placed& placed, double offset) {
  const auto at = [&](double z) { return Vec3(placed.position.x(), placed.position.y(), z + placed.lift_m); };
  if (const auto& box = placed.shape->box)
    add_box(scene, at(box->z_m), Vec3(box->width_m, box->depth_m, box->height_m), placed.yaw_rad, box->material,
            offset);
  if (const auto& board = placed.shape->board)
    add_board(scene, at(board->z_m), board->edge_m, placed.yaw_rad, board->picture);
  if (const auto& person = placed.shape->person)
    add_person(scene, placed.position, placed.yaw_rad, person->height_m, person->points, person->pointing_rad);
  if (const auto& person = placed.shape->person; person && person->shirt) add_shirt(scene, placed);
}

void add_moving(Scene& scene, const Placed& placed, double offset) {
  const size_t first = scene.quads.size();
  add_placed(scene, placed, offset);
  for (size_t i = first; i < scene.quads.size(); ++i) {
    Quad& quad = scene.quads[i];
    if (quad.picture) continue;  // keeps to its board anyway
    quad.u_offset -= quad.u_axis.dot(quad.corner[0]);
    quad.v_offset -= quad.v_axis.dot(quad.corner[0]);
  }
}

double cast_box(const Placed& placed, const Vec3& origin, const Vec3& direction) {
  const auto& box = placed.shape->box;
  if (!box) return kNever;
  const auto in_box = [&](const Vec2& level, double z) {
    const Vec2 turned = local(placed, level);
    return Vec3(turned.x(), turned.y(), z);
  };
  const Vec3 half = Vec3(box->width_m, box->depth_m, box->height_m) / 2;
  const Vec3 o = in_box(origin.head<2>() - placed.position, origin.z() - box->z_m - placed.lift_m - half.z());
  const Vec3 d = in_box(direction.head<2>(), direction.z());
  double near = 0, far = kNever;  // slabs of the three axes
  for (int i = 0; i < 3; ++i) {
    if (std::abs(d[i]) < 1e-12) {
      if (std::abs(o[i]) > half[i]) return kNever;
      continue;
    }
    const double t0 = (-half[i] - o[i]) / d[i], t1 = (half[i] - o[i]) / d[i];
    near = std::max(near, std::min(t0, t1));
    far = std::min(far, std::max(t0, t1));
  }
  return near <= far ? near : kNever;
}

double cast_capsules(std::span<const Capsule> capsules, const Vec3& origin, const Vec3& direction) {
  double nearest = kNever;
  for (const Capsule& capsule : capsules) nearest = std::min(nearest, cast_capsule(capsule, origin, direction));
  return nearest;
}

bool touches(const Placed& placed, const Vec2& centre, double radius) {
  if (placed.shape->person && (placed.position - centre).norm() < radius + kPersonRadius) return true;
  if (!placed.shape->box || placed.shape->box->z_m + placed.lift_m > kAboveTheRobot) return false;
  return beyond(placed, centre).squaredNorm() < radius * radius;
}

double distance_to(const Placed& placed, const Vec2& point) {
  const double centre = (placed.position - point).norm();
  double nearest = kNever;
  if (placed.shape->person) nearest = std::max(centre - kPersonRadius, 0.0);
  if (placed.shape->box) nearest = std::min(nearest, beyond(placed, point).norm());
  return std::min(nearest, centre);
}

double top_m(const Placed& placed) {
  const auto& box = placed.shape->box;
  return box ? box->z_m + placed.lift_m + box->height_m : 0;
}

}  // namespace takt::sim
