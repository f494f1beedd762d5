// SPDX-License-Identifier: Apache-2.0
// What objects stand on: the largest nearly level plane of a cloud.
#pragma once
#include <optional>
#include <span>

#include "rt/msg/point.hpp"

namespace takt::object_3d {

/// z = a x + b y + c, metres, z up.
struct Plane {
  double a = 0, b = 0, c = 0;
  double z(double x, double y) const { return a * x + b * y + c; }
  /// Above the plane, along z.
  double above(const Point& p) const {
    return static_cast<double>(p.z) - z(static_cast<double>(p.x), static_cast<double>(p.y));
  }
};

struct SupportParameters {
  double low_m = 0.3, high_m = 1.2;  ///< heights at which it is looked for; at most 10 m apart
  double band_m = 0.015;             ///< points no farther than this from the plane are its own
  double slope_max = 0.1;            ///< tangent of the steepest plane that counts as level
  size_t fewest = 500;               ///< points that it must have
};

/// The level with most points within `band_m`, then three times the plane of least squares through the points within
/// that of it; the first time from twice the band, for a mount that is not quite level. None where there is no such
/// plane. Allocates nothing.
std::optional<Plane> find_support(std::span<const Point> points, const SupportParameters& parameters);

}  // namespace takt::object_3d
