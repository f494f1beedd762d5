// SPDX-License-Identifier: Apache-2.0
#include "nodes/mission/pointing.hpp"

#include <cmath>
#include <limits>

#include "rt/transform/planar_pose.hpp"

namespace takt::mission {
namespace {

constexpr double kBeside_m = 0.8;        // a head from where somebody is said to be
constexpr double kSteepest = 0.4226183;  // sine of 25 degrees

}  // namespace

std::optional<double> pointed_direction(const BodyPoses& bodies, double x_m, double y_m) {
  const Body* asked = nullptr;
  double nearest = kBeside_m;
  for (const Body& body : bodies.bodies.items()) {
    const double distance = std::hypot(body.joints[0].x - x_m, body.joints[0].y - y_m);
    if (distance > nearest) continue;
    nearest = distance;
    asked = &body;
  }
  if (asked == nullptr) return std::nullopt;
  const PointingRay* ray = nullptr;
  for (const PointingRay& r : asked->pointing) {
    const bool found = r.dx != 0 || r.dy != 0 || r.dz != 0;
    if (found && std::abs(r.dz) <= kSteepest && (ray == nullptr || std::abs(r.dz) < std::abs(ray->dz))) ray = &r;
  }
  if (ray == nullptr) return std::nullopt;
  return std::atan2(-ray->dx, ray->dy);
}

double middle_direction(std::span<const double> directions_rad) {
  double middle = directions_rad.front(), least = std::numeric_limits<double>::infinity();
  for (const double candidate : directions_rad) {
    double sum = 0;
    for (const double other : directions_rad) sum += std::abs(wrapped(other - candidate));
    if (sum >= least) continue;
    least = sum;
    middle = candidate;
  }
  return middle;
}

}  // namespace takt::mission
