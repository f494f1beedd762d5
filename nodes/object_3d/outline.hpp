// SPDX-License-Identifier: Apache-2.0
// The outline of an object from above: convex hull and the smallest rectangle around it.
#pragma once
#include <span>
#include <vector>

namespace takt::object_3d {

struct Point2 {
  double x = 0, y = 0;
  auto operator<=>(const Point2&) const = default;
};

/// Moves the corners of the convex hull to the front of `points`, counter-clockwise from the lowest x (of these the
/// lowest y), none of them on the line between its neighbours; returns them. `scratch` is twice as long as `points`.
/// O(n log n).
std::span<const Point2> convex_hull(std::span<Point2> points, std::span<Point2> scratch);

/// Of a hull, m^2.
double area_of(std::span<const Point2> hull);
/// Whether a point lies in a hull or on its rim.
bool inside(std::span<const Point2> hull, const Point2& p);

struct Rectangle {
  Point2 centre;
  double length = 0, width = 0;  ///< length >= width
  double yaw_rad = 0;            ///< direction of the length, from the x axis, -pi/2 .. pi/2
};

/// The rectangle of smallest area around a hull: one of its sides lies on a side of the hull.
Rectangle smallest_rectangle(std::span<const Point2> hull);

/// The corners in the order of `points`, the slow and obvious way: a point is one if from it some other point has all
/// the rest on its left.
std::vector<Point2> convex_hull_reference(std::span<const Point2> points);

}  // namespace takt::object_3d
