// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <span>

#include "hal/sim/world.hpp"

namespace takt::sim {

/// A shape where it stands.
struct Placed {
  const Shape* shape = nullptr;  ///< of a world that outlives this
  Vec2 position = Vec2::Zero();
  double yaw_rad = 0, lift_m = 0;  ///< lift: how much higher than the shape's z says
  bool operator==(const Placed& other) const {
    return shape == other.shape && position == other.position && yaw_rad == other.yaw_rad && lift_m == other.lift_m;
  }
};
/// An object as it begins.
Placed as_it_begins(const WorldObject& object);

/// What a camera sees of it. Each box starts at another place of its texture, `offset`.
void add_placed(Scene& scene, const Placed& placed, double offset);
/// Where the texture of the world's object of that number starts, of those that move or change.
inline double texture_start(size_t object) { return 0.37 * static_cast<double>(object); }
/// The same; the texture keeps to its place on the box, wherever that stands.
void add_moving(Scene& scene, const Placed& placed, double offset);

/// Distance along a ray (unit) to its box, 0 from within; infinite if that is not hit.
double cast_box(const Placed& placed, const Vec3& origin, const Vec3& direction);
/// The same to any of the capsules, of which persons are made.
double cast_capsules(std::span<const Capsule> capsules, const Vec3& origin, const Vec3& direction);

/// True if a circle on the floor touches its box or person.
bool touches(const Placed& placed, const Vec2& centre, double radius);
/// From a point to the nearest of its box or person from above, 0 inside; to its position if there is neither.
double distance_to(const Placed& placed, const Vec2& point);
/// Height of its upper side: where something stands that is put on it.
double top_m(const Placed& placed);

}  // namespace takt::sim
