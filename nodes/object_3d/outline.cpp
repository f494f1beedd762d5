// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_3d/outline.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace takt::object_3d {
namespace {

/// Above 0: a, b, c turn left.
double turn(const Point2& a, const Point2& b, const Point2& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

}  // namespace

// Andrew's monotone chain: the lower rim from left to right, the upper one back.
std::span<const Point2> convex_hull(std::span<Point2> points, std::span<Point2> scratch) {
  std::sort(points.begin(), points.end());
  const auto n = static_cast<size_t>(std::unique(points.begin(), points.end()) - points.begin());
  if (n < 3) return points.first(n);
  size_t size = 0;
  const auto add = [&](const Point2& p, size_t fixed) {
    while (size >= fixed + 2 && turn(scratch[size - 2], scratch[size - 1], p) <= 0) --size;
    scratch[size++] = p;
  };
  for (size_t i = 0; i < n; ++i) add(points[i], 0);
  const size_t lower = size - 1;  // the rightmost point, with which the upper rim begins
  for (size_t i = n - 1; i-- > 0;) add(points[i], lower);
  --size;  // the first point again
  std::copy_n(scratch.begin(), size, points.begin());
  return points.first(size);
}

double area_of(std::span<const Point2> hull) {
  double twice = 0;
  for (size_t i = 2; i < hull.size(); ++i) twice += turn(hull[0], hull[i - 1], hull[i]);
  return twice / 2;
}

bool inside(std::span<const Point2> hull, const Point2& p) {
  for (size_t i = 0; i < hull.size(); ++i)
    if (turn(hull[i], hull[(i + 1) % hull.size()], p) < 0) return false;
  return true;
}

Rectangle smallest_rectangle(std::span<const Point2> hull) {
  Rectangle best;
  if (hull.empty()) return best;
  best.centre = hull[0];
  double smallest = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < hull.size() && hull.size() > 1; ++i) {
    const Point2 &a = hull[i], &b = hull[(i + 1) % hull.size()];
    const double side = std::hypot(b.x - a.x, b.y - a.y), c = (b.x - a.x) / side, s = (b.y - a.y) / side;
    double low_u = std::numeric_limits<double>::infinity(), high_u = -low_u, low_v = low_u, high_v = -low_u;
    for (const Point2& p : hull) {
      const double u = c * p.x + s * p.y, v = c * p.y - s * p.x;
      low_u = std::min(low_u, u), high_u = std::max(high_u, u);
      low_v = std::min(low_v, v), high_v = std::max(high_v, v);
    }
    const double along = high_u - low_u, across = high_v - low_v;
    if (along * across >= smallest) continue;
    smallest = along * across;
    const double u = (low_u + high_u) / 2, v = (low_v + high_v) / 2;
    double yaw = std::atan2(s, c) + (along < across ? std::numbers::pi / 2 : 0);
    yaw = std::remainder(yaw, std::numbers::pi);
    best = {{c * u - s * v, s * u + c * v}, std::max(along, across), std::min(along, across), yaw};
  }
  return best;
}

std::vector<Point2> convex_hull_reference(std::span<const Point2> points) {
  std::vector<Point2> hull;
  for (const Point2& p : points) {
    // A corner has a neighbour on the hull such that everything else lies to the left, or behind p on the line.
    const bool corner = std::any_of(points.begin(), points.end(), [&](const Point2& next) {
      return next != p && std::all_of(points.begin(), points.end(), [&](const Point2& other) {
               const double side = turn(p, next, other);
               const double along = (other.x - p.x) * (next.x - p.x) + (other.y - p.y) * (next.y - p.y);
               return side > 0 || (side == 0 && along >= 0);
             });
    });
    if (corner && std::find(hull.begin(), hull.end(), p) == hull.end()) hull.push_back(p);
  }
  return hull;
}

}  // namespace takt::object_3d
