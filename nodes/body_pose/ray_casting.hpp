// SPDX-License-Identifier: Apache-2.0
// What generated scenes are made of: balls drawn along lines and boxes that rays meet, and numbers drawn by lot.
#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>

namespace takt::body_pose {

/// The same numbers everywhere, which the distributions of the standard library do not promise.
class Lot {
 public:
  Lot(uint64_t seed, uint64_t index) : bits_(seed * 0x9E3779B97F4A7C15ull + index) { bits_.discard(8); }
  double in(double low, double high) { return low + (high - low) * (static_cast<double>(bits_() >> 11) * 0x1p-53); }
  bool chance(double p) { return in(0, 1) < p; }
  double normal() {
    const double radius = std::sqrt(-2 * std::log(1 - in(0, 1)));
    return radius * std::cos(in(0, 2 * std::numbers::pi));
  }
  Eigen::Vector3d unit() { return Eigen::Vector3d(normal(), normal(), normal()).normalized(); }

 private:
  std::mt19937_64 bits_;
};

struct Bgr {
  uint8_t b, g, r;
};
/// A ball that is drawn along a line.
struct Capsule {
  Eigen::Vector3d from, to;
  double radius;
  Bgr colour;
};
struct Box {
  Eigen::Vector3d low, high;
  Bgr colour;
};
/// What a ray that meets nothing meets.
constexpr double kNever = std::numeric_limits<double>::infinity();

/// Distance along a ray (unit direction) to its first point in a ball.
inline double meet_ball(const Eigen::Vector3d& origin, const Eigen::Vector3d& ray, const Eigen::Vector3d& centre,
                        double radius) {
  const Eigen::Vector3d to = centre - origin;
  const double along = to.dot(ray), squared = radius * radius - (to.squaredNorm() - along * along);
  if (squared < 0) return kNever;
  const double distance = along - std::sqrt(squared);
  return distance > 0 ? distance : kNever;
}

inline double meet(const Eigen::Vector3d& origin, const Eigen::Vector3d& ray, const Capsule& c) {
  double nearest = std::min(meet_ball(origin, ray, c.from, c.radius), meet_ball(origin, ray, c.to, c.radius));
  const Eigen::Vector3d line = c.to - c.from;
  const double length = line.norm();
  if (length < 1e-9) return nearest;
  const Eigen::Vector3d axis = line / length, to = c.from - origin;
  const Eigen::Vector3d across = ray - axis * ray.dot(axis), to_across = to - axis * to.dot(axis);
  const double a = across.squaredNorm(), b = across.dot(to_across);
  const double root = b * b - a * (to_across.squaredNorm() - c.radius * c.radius);
  if (a < 1e-12 || root < 0) return nearest;
  const double distance = (b - std::sqrt(root)) / a;
  const double at = (ray * distance - to).dot(axis);
  if (distance > 0 && at >= 0 && at <= length) nearest = std::min(nearest, distance);
  return nearest;
}

inline double meet(const Eigen::Vector3d& origin, const Eigen::Vector3d& ray, const Box& box) {
  double enter = 0, leave = kNever;
  for (int k = 0; k < 3; ++k) {
    const double a = (box.low[k] - origin[k]) / ray[k], b = (box.high[k] - origin[k]) / ray[k];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return enter < leave && enter > 0 ? enter : kNever;
}

}  // namespace takt::body_pose
